"""Many rigs on a GPU: the muscles' kernel in Warp, the mechanics by `mujoco_warp`."""
