"""What reaches a flight controller on serial lines beside MAVLink: a radio's SBUS, a configurator's MSP. Bytes only."""
