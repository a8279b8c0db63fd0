"""A cartwheel to the left: the body turns about its front while hands and feet touch the floor in turn."""
