"""The answers of a process engineer to the wizard."""

ENGINEER = {
    "plant": "gain about 2, time constant about 3 min, dead time about 25 s, each within 30 %",
    "wish": "PI loop with 6 dB",
    "range": "plus/minus 5 around 40",
    "time": "1 h",
    "noise": "standard deviation 0.2",
}
