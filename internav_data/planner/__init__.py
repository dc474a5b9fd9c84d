"""Navigation among movable obstacles (Stilman and Kuffner 2005): the expert."""
