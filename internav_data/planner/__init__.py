"""Expert of navigation among movable obstacles (NAMO, Stilman and Kuffner 2005)."""
