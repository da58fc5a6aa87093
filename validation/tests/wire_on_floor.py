"""A scene of a straight wire pushed 40 mm over a floor, in ten steps: the least that a study can sweep."""

SCENE = {
    "schema": 1,
    "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, 0, -0.002]}},
        "wire": {"kind": "beam",
                 "segments": [{"length": 0.1, "radius": 4e-4, "EI": 5e-4, "element": 2.5e-3}],
                 "drive": {"insertion": [[0, 0], [1, 0.04]]}}},
    "contact": [{"between": ["wire", "floor"], "friction": 0.1}],
    "time": {"step": 0.1, "end": 1},
}
