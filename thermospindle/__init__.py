"""Thermospindle: from temperature to the modal peaks of a spindle, and from measurements to the physics a model lacks."""
