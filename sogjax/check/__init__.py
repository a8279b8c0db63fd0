"""What is wrong with a recording: each check ends in findings with likely cause and remedy."""
