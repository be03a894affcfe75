"""The built-in scenes, a module for each family."""
