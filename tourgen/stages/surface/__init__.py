"""Surface reconstruction: one file a method, one signature."""
