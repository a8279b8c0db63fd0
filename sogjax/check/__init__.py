"""What is wrong with a recording: each check ends in findings with the likely cause and the remedy."""
