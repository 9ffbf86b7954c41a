"""The parameters of a Copter that this simulator does not use: ArduCopter 4.6 names, types and defaults.

They are listed and can be set, but nothing here reads them.
"""
