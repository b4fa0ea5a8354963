"""Gymnasium environments of the antagonistic arm; importing this room registers them."""

from pamsim.envs.registration import register

register()
