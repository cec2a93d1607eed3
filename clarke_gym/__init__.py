"""clarke_gym: continuum robots in raw tendon space or Clarke coordinates."""

__version__ = "0.1.0"
