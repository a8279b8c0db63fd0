"""What is wrong with a recording: each look at it ends in findings with likely cause and remedy."""
