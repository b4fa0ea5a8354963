"""Gymnasium environments of any rig; importing this room registers them."""

from pamsim.envs.registration import register

register()
