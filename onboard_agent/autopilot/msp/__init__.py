"""A flight controller that speaks MSP (MultiWii, Betaflight, INAV), shown as MAVLink. Bytes and `now` in, bytes out."""
