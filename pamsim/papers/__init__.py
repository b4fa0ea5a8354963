"""The five source papers: the main job, and every printed number recomputed."""
