"""Configuration of the commands by Hydra: schemas, composition, the words of a command line."""
