"""Examples in the reference of keys: a smallest complete case, and changes of this case."""

SMALLEST = """\
name = "ball_on_plate"

[[parts]]
name = "ball"
material = "steel_4340"
velocity = ["0 m/s", "0 m/s", "-600 m/s"]

[parts.mesh]
shape = "sphere"
centre = ["0 mm", "0 mm", "5 mm"]
radius = "5 mm"
element_size = "1 mm"

[[parts]]
name = "plate"
material = "aluminium_2024"

[parts.mesh]
shape = "plate"
base = ["0 mm", "0 mm", "-4 mm"]
width = "60 mm"
height = "60 mm"
thickness = "4 mm"
element_size = "1 mm"

[run]
end_time = "50 us"
"""
"""A complete case. Of the keys that have defaults it has only the velocity and the positions of the bodies."""

EXAMPLES = {
    "`parts[].erosion`": """\
[[parts]]
name = "plate"
erosion = { plastic_strain = 1.2 }
""",
    "`parts[].fracture`": """\
[[parts]]
name = "plate"
material = "soda_lime"
fracture = { model = "cohesive" }
""",
    "`parts[].rigid`": """\
[[parts]]
name = "ball"
rigid = { mass = "4 g" }
""",
    "`parts[].spin`": """\
[[parts]]
name = "ball"
spin = { centre = ["0 mm", "0 mm", "5 mm"], rate = ["0 rpm", "0 rpm", "30000 rpm"] }
""",
    "`parts[].turn`": """\
[[parts]]
name = "plate"
turn = { axis = "x", angle = "30 deg", centre = ["0 mm", "0 mm", "5 mm"] }
""",
    "`parts[].mesh.grading`": """\
[[parts]]
name = "plate"

[parts.mesh.grading]
axis = "z"
near = "8 mm"
far = "25 mm"
far_size = "3 mm"
""",
    '`parts[].mesh` with `shape = "difference"`': """\
[[parts]]
name = "plate"

[parts.mesh]
shape = "difference"
element_size = "1 mm"
of = [
  { shape = "plate", base = [0, 0, "-4 mm"], width = "60 mm", height = "60 mm", thickness = "4 mm" },
  { shape = "cylinder", base = ["20 mm", 0, "-5 mm"], radius = "3 mm", length = "6 mm" },
]
""",
    '`parts[].mesh` with `shape = "ogive"`': """\
[[parts]]
name = "ball"

[parts.mesh]
shape = "ogive"
pointing = "low"
radius = "5 mm"
shank = "20 mm"
crh = 3.0
element_size = "1 mm"
""",
    "`materials.NAME`": """\
[materials.my_steel]
density = "7850 kg/m^3"
elastic = { young = "210 GPa", poisson = 0.3 }
strength = { model = "linear_hardening", yield_stress = "800 MPa", hardening = "1 GPa" }
""",
    '`boundaries[]` with `kind = "symmetry"`': """\
[[boundaries]]
kind = "symmetry"
axis = "x"
""",
    '`boundaries[]` with `kind = "wall"`': """\
[[boundaries]]
kind = "wall"
point = ["0 mm", "0 mm", "-10 mm"]
normal = [0, 0, 1]
""",
    '`boundaries[]` with `kind = "velocity"`': """\
[[boundaries]]  # The border of the plate is clamped on one side.
kind = "velocity"
parts = ["plate"]
low = ["-30 mm", "-30 mm", "-4 mm"]
high = ["-28 mm", "30 mm", "0 mm"]
x = "0 m/s"
y = "0 m/s"
z = "0 m/s"
""",
    '`boundaries[]` with `kind = "rotation"`': """\
[[boundaries]]
kind = "rotation"
parts = ["ball"]
spin = { centre = ["0 mm", "0 mm", "5 mm"], rate = ["0 rad/s", "0 rad/s", "2000 rad/s"] }
""",
    '`boundaries[]` with `kind = "gravity"`': """\
[[boundaries]]
kind = "gravity"
acceleration = [0, 0, "-9.81 m/s^2"]
""",
    '`boundaries[]` with `kind = "traction"`': """\
[[boundaries]]  # A pressure pulse on the lower face of the plate.
kind = "traction"
parts = ["plate"]
low = ["-30 mm", "-30 mm", "-4 mm"]
high = ["30 mm", "30 mm", "-4 mm"]
pressure = "20 MPa"
course = [["0 us", 1], ["10 us", 0]]
""",
    '`bond[]` with `kind = "tied"`': """\
[[bond]]
kind = "tied"
parts = ["ball", "plate"]
strength = "40 MPa"
energy = "200 J/m^2"
""",
    "`contact`": """\
[contact]
friction = 0.1
pairs = [{ parts = ["ball", "plate"], friction = 0.3 }]
""",
    "`probes[]`": """\
[[probes]]
name = "push"
part = "plate"
field = "contact_force_z"
by = "ball"

[[probes]]
name = "behind"
part = "ball"
field = "residual_velocity"
beyond = { axis = "z", at = "-10 mm", side = "below" }
""",
    "`reference[]`": """\
[[reference]]
quantity = "speed_mean"
part = "ball"
axis = "z"
value = "-420 m/s"
tolerance = "20 m/s"
source = "ballistic limit, report of 2024"
""",
    "`numerics`": """\
[numerics]
pressure = "nodal"
dt_safety = 0.6
""",
    "`run`": """\
[run]
ranks = 4
threads = 2
frames = 50
max_wall_time = "8 h"
""",
}
"""Changes of the smallest case that show a table, by the title of the section of this table. If a change names a part
that the smallest case has, its keys are added to this part."""
