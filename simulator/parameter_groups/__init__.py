"""What fills a Copter's parameter list beside what this simulator flies by: ArduCopter 4.6 names, types and defaults.

They are told and can be set; nothing here reads them.
"""
