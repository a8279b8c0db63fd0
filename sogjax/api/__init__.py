"""What `import sogjax` offers: the work of the commands as functions, which write no files unless told to."""
