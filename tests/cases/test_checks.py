"""Checks between the keys of a case: each error of a case is found, and a valid case has no error."""

import pytest

from conoid.cases.load import parse_case

from .scenes import messages, problems, rod

BOX = 'parts[0].mesh={shape="box", low=[0, 0, 0], high=["1 mm", "1 mm", "9 mm"], element_size="0.5 mm"}'
SLIT = BOX[:-1] + ', generator="structured", slit={axis="z", at="3 mm", low=[0, 0], high=["0.5 mm", "1 mm"]}}'
SHARDS = 'parts[0].mesh={shape="shards", count=[2, 2, 2], element_size="1 mm"}'
TUBE = 'parts[0].mesh={shape="tube", inner_radius="2 mm", radius="3 mm", length="30 mm", element_size="0.5 mm"}'


def test_the_rod_is_sound() -> None:
    parse_case(rod())
    parse_case(rod("parts[0].material=copper_taylor", "parts[0].erosion={plastic_strain=1}"))
    parse_case(rod(TUBE))
    parse_case(rod(SLIT, "probes=[]"))
    parse_case(rod(SHARDS, "probes=[]"))
    parse_case(rod('parts[0].mesh={shape="two_tets", element_size=1, centre=[0, 0, 1]}', "probes=[]"))


@pytest.mark.parametrize(
    ("overrides", "key", "message"),
    [
        (["parts[0].material=stel"], "parts[0].material", "did you mean 'steel'?"),
        (["boundaries[0].parts=['road']"], "boundaries[0].parts[0]", "did you mean 'rod'?"),
        (["probes[0].part=road"], "probes[0].part", "did you mean 'rod'?"),
        (["reference[0].part=road"], "reference[0].part", "did you mean 'rod'?"),
        ([TUBE, "parts[0].mesh.inner_radius=3 mm"], "parts[0].mesh.inner_radius", "must be below the radius, 0.003 m"),
        ([BOX, "parts[0].mesh.high[1]=0", "probes=[]"], "parts[0].mesh.high[1]", "must be above low[1]"),
        ([BOX, "parts[0].mesh.sector=half", "parts[0].mesh.low[0]=-1", "parts[0].mesh.high[0]=0", "probes=[]"],
         "parts[0].mesh.high[0]", "keeps the side x > 0"),
        (["parts[0].mesh.element_size=4 mm"], "parts[0].mesh.element_size", "the modelled part, 0.003"),
        ([TUBE, "parts[0].mesh.element_size=1.1 mm"], "parts[0].mesh.element_size", "0.001 m"),
        (["parts[0].mesh.grading={near=2, far=1, far_size=1}"], "parts[0].mesh.grading.near", "must be below far"),
        (["parts[0].mesh.grading={near=0, far=1, far_size='0.5 mm'}"], "parts[0].mesh.grading.far_size", "below the"),
        (["parts[0].mesh.grading={near=0, far=1, far_size=1, normal='z', axis='x'}"], "parts[0].mesh.grading.normal",
         "no axis and no radius"),
        (["parts[0].mesh.grading={near=0, far=1, far_size=1, surface=true, origin=[0,0,0]}"],
         "parts[0].mesh.grading.surface", "from the surface of the body"),
        (["parts[0].mesh.grading={near=0, far=1, far_size=1}", "parts[0].mesh.generator=structured"],
         "parts[0].mesh.grading", "needs generator = 'gmsh'"),
        ([SLIT, "probes=[]", "parts[0].mesh.generator=gmsh"], "parts[0].mesh.slit", "needs generator = 'structured'"),
        ([SLIT, "probes=[]", "parts[0].mesh.slit.at=3.1 mm"], "parts[0].mesh.slit.at", "0.0005 m apart, from z = 0 m"),
        ([SLIT, "probes=[]", "parts[0].mesh.slit.at=9 mm"], "parts[0].mesh.slit.at", "inside the body"),
        ([SLIT, "probes=[]", "parts[0].mesh.slit.high[1]=0.6 mm"], "parts[0].mesh.slit.high[1]", "or outside the body"),
        ([SLIT, "probes=[]", "parts[0].mesh.slit.low[1]=1 mm"], "parts[0].mesh.slit.high[1]", "must be above low[1]"),
        ([SLIT, "probes=[]", "parts[0].mesh.slit.low[1]=0.5 mm", "parts[0].mesh.slit.high[1]=3 mm",
          "parts[0].mesh.slit.low[0]=-2 mm", "parts[0].mesh.slit.high[0]=-1 mm"], "parts[0].mesh.slit", "outside the"),
        ([SHARDS, "probes=[]", "parts[0].mesh.count[0]=0"], "parts[0].mesh.count[0]", "greater than or equal to 1"),
        ([SHARDS, "probes=[]", "parts[0].mesh.perturbation=0.2"], "parts[0].mesh.perturbation", "less than or equal"),
        ([SHARDS, "probes=[]", "parts[0].mesh.sector=half"], "parts[0].mesh.sector", "'full'"),
        ([SHARDS, "probes=[]", "parts[0].mesh.axis=x"], "parts[0].mesh.axis", "unknown key"),
        (["boundaries[1].axis=z"], "parts[0].mesh.sector", "axis = 'x', at = 0 for part 'rod'"),
        (["boundaries[2].at=1 mm"], "parts[0].mesh.sector", "axis = 'y', at = 0 for part 'rod'"),
        (["boundaries[0].normal=[0, 0, 0]"], "boundaries[0].normal", "must not be zero"),
        (["boundaries[0].normal=[0, 0, 1e200]"], "boundaries[0].normal[2]", "is not between 1e-30 and 1e+30"),
        (["boundaries[0].normal=[0, 0, -1]"], "boundaries[0]", "part 'rod' starts 0.03 m behind this wall"),
        (["boundaries[0].point=[0, 0, '1 mm']"], "boundaries[0]", "part 'rod' starts 0.001 m behind this wall"),
        (["boundaries[0]={kind='gravity', acceleration=[0, 0, 0]}"], "boundaries[0].acceleration", "must not be zero"),
        (["boundaries[0]={kind='gravity', acceleration=[0, 0, 1], course=[[1, 1], [1, 0]]}"],
         "boundaries[0].course[1][0]", "must be later than the time before it, 1 s"),
        (["boundaries[0]={kind='gravity', acceleration=[0, 0, 1], parts=['a']}"], "boundaries[0].parts[0]", "no part"),
        (["boundaries[0]={kind='traction', stress=[0, 0, 0]}"], "boundaries[0].stress", "must not be zero"),
        (["boundaries[0]={kind='symmetry', axis='z', at='40 mm'}"], "boundaries[0].at", "between 0 and 0.03 m along z"),
        (["boundaries[0]={kind='velocity', x=1, low=['4 mm', 0, 0], high=['5 mm', 1, 1]}"], "boundaries[0]",
         "contains no body; the bodies are in ("),
        (["boundaries[0]={kind='traction', pressure=1, low=[0, 0, -2], high=[1, 1, -1]}"], "boundaries[0]",
         "contains no body; the bodies"),
        (["boundaries[0]={kind='traction', pressure=1, low=['1 mm', '1 mm', '9 mm'], high=['2 mm', '2 mm', '10 mm']}"],
         "boundaries[0]", "the box lies inside 'rod'; tractions act on surfaces"),
        (["contact={pairs=[{parts=['rod', 'rod'], friction=0.1}]}"], "contact.pairs[0].parts", "has no self-contact"),
        (["contact.self_contact=['rod']",
          "contact.pairs=[{parts=['rod', 'rod'], friction=0.1}, {parts=['rod', 'rod'], friction=0.2}]"],
         "contact.pairs[1].parts", "contact.pairs[0] has the same parts"),
        (["boundaries[0]={kind='traction'}"], "boundaries[0]", "needs either stress or pressure"),
        (["boundaries[0]={kind='traction', stress=[0, 0, 1], pressure=1}"], "boundaries[0]", "needs either stress or"),
        (["boundaries[0]={kind='traction', pressure=0}"], "boundaries[0].pressure", "must not be zero"),
        (["boundaries[0]={kind='traction', pressure=1, course=[[0, 1], [1, 0], [1, 2]]}"], "boundaries[0].course[2][0]",
         "must be later than the time before it, 1 s"),
        (["boundaries[0]={kind='traction', stress=[0, 0, 1], high=[0, 0, 0]}"], "boundaries[0]", "needs both low and"),
        (["boundaries[0]={kind='traction', stress=[0, 0, 1], low=[0, 0, 1], high=[1, 1, 0]}"], "boundaries[0].high[2]",
         "below low[2]"),
        (["boundaries[0]={kind='traction', stress=[0, 0, 1], parts=['a']}"], "boundaries[0].parts[0]", "no part"),
        (["parts[0].jitter=-1"], "parts[0].jitter", "greater than or equal to 0"),
        (["boundaries[0]={kind='velocity'}"], "boundaries[0]", "needs at least one of x, y, z"),
        (["boundaries[0]={kind='velocity', x=1, low=[0, 0, 0]}"], "boundaries[0]", "needs both low and high"),
        (["boundaries[0]={kind='velocity', x=1, low=[0, 0, 1], high=[1, 1, 0]}"], "boundaries[0].high[2]", "low[2]"),
        (["probes[0].wall=anvil"], "probes[0].wall", "stress_zz does not use this key; remove it"),
        (["probes[0].low[2]=17 mm"], "probes[0].high[2]", "must not be below low[2]"),
        (["probes[0].low[2]=31 mm", "probes[0].high[2]=32 mm"], "probes[0]", "lies between 0 and 0.03 m along z"),
        (["probes[0].low[0]=-2 mm", "probes[0].high[0]=-1 mm"], "probes[0]", "lies between 0 and 0.003 m along x"),
        (["reference[0].probe=middle"], "reference[0].probe", "'extent' does not use this key"),
        (["reference[0].since=10 us"], "reference[0].since", "must be below run.end_time"),
        (["reference[0].until=11 us"], "reference[0].until", "not above run.end_time"),
        (["reference[0].since=5 us", "reference[0].until=5 us"], "reference[0].until", "must be above since"),
        (["contact={parts=['road']}"], "contact.parts[0]", "did you mean 'rod'?"),
        (["contact={self_contact=['rode']}"], "contact.self_contact[0]", "did you mean 'rod'?"),
        (["contact={pairs=[{parts=['rod', 'plate'], friction=0.1}]}"], "contact.pairs[0].parts[1]", "known: 'rod'"),
        (["contact={friction=-0.1}"], "contact.friction", "greater than or equal to 0"),
        (["contact={domain='sphere'}"], "contact.domain", "'arbitrary' or 'box'"),
        (["parts[0].material=steel_42crmo4", "parts[0].temperature=2000"], "parts[0].temperature", "melts"),
        (["parts[0].erosion={plastic_strain=1}"], "parts[0].erosion.plastic_strain", "steel is elastic"),
        (["parts[0].erosion={plastic_strain=0}"], "parts[0].erosion.plastic_strain", "greater than 0"),
        (["parts[0].erosion={volume=[0, 2]}"], "parts[0].erosion.volume[0]", "greater than 0"),
        (["parts[0].erosion={volume=[2, 3]}"], "parts[0].erosion.volume[0]", "less than 1"),
        (["parts[0].erosion={volume=[0.5, 1]}"], "parts[0].erosion.volume[1]", "greater than 1"),
        (["parts[0].erosion={volume=0.1}"], "parts[0].erosion.volume", "expected a list of 2"),
        (["parts[0].erosion={time_step=1}"], "parts[0].erosion.time_step", "less than 1"),
        (["parts[0].erosion={time_step=0}"], "parts[0].erosion.time_step", "greater than 0"),
        (["parts[0].erosion={nodes='keep'}"], "parts[0].erosion.nodes", "'strike', 'particles' or 'remove'"),
        (["parts[0].material=steel_42crmo4", "parts[0].erosion={damage=1}"], "parts[0].erosion.damage",
         "'johnson_holmquist', or 'johnson_cook' with a table damage"),
        (["parts[0].erosion={damage=1}"], "parts[0].erosion.damage", "steel has no damage"),
        (["probes[0].name=kinetic"], "probes[0].name", "allowed: any name but 'step', 't', 'dt'"),
        (["probes[0].name=dt"], "probes[0].name", "is a column of every history.csv"),
        (["probes[0].name=momentum_x"], "probes[0].name", "is a column of every history.csv"),
        (["parts[0].erosion={strain=1}"], "parts[0].erosion.strain", "did you mean 'plastic_strain'?"),
    ],
)  # fmt: skip
def test_a_fault_is_named(overrides: list[str], key: str, message: str) -> None:
    found = messages(*overrides)
    assert list(found) == [key]
    assert message in found[key]


def test_a_body_that_moves_to_a_symmetry_plane_need_not_start_on_it() -> None:
    """The rod of the case moves down: towards a plane below the rod, and away from a plane above the rod."""
    parse_case(rod("boundaries[0]={kind='symmetry', axis='z', at='-1 mm'}"))
    assert "boundaries[0].at" in messages("boundaries[0]={kind='symmetry', axis='z', at='40 mm'}")


def test_names_are_unique() -> None:
    data = rod()
    data["parts"].append({**data["parts"][0]})
    data["probes"].append({**data["probes"][0]})
    data["boundaries"].append({**data["boundaries"][0]})
    found = [(p.key, p.message) for p in problems(*_as_overrides(data))]
    assert found == [
        ("parts[1].name", "parts[0] has this name; use different names"),
        ("parts[1].mesh", found[1][1]),
        ("boundaries[3].name", "an earlier wall has this name; use different names"),
        ("probes[1].name", "probes[0] has this name; use different names"),
    ]
    assert "overlaps" in found[1][1]


def _as_overrides(data: dict[str, object]) -> list[str]:
    """Returns overrides that set whole lists of ``data``, written in TOML, in which a list of tables has equals
    signs.
    """
    return [f"{key}={_toml(data[key])}" for key in ("parts", "probes", "boundaries")]


def _toml(value: object) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {_toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return repr(value)


def test_a_reference_needs_the_keys_of_its_quantity() -> None:
    assert messages("reference[0]={quantity='probe_max', value=1, tolerance=1, source='s'}") == {
        "reference[0].probe": "this key is missing; 'probe_max' needs 'probe'"
    }
    assert messages("reference[0]={quantity='radius', value=1, tolerance=1, source='s'}") == {
        "reference[0].axis": "this key is missing; 'radius' needs 'axis', 'part'",
        "reference[0].part": "this key is missing; 'radius' needs 'axis', 'part'",
    }


def test_contact_time_needs_a_wall_or_contact() -> None:
    contact = "reference[0]={quantity='contact_time', value='1 us', tolerance='1 us', source='s'}"
    parse_case(rod(contact))
    found = messages(contact, "boundaries[0]={kind='symmetry', axis='z'}")
    assert found == {"reference[0].quantity": "needs a boundary with kind = 'wall', or contact"}


@pytest.mark.parametrize(
    ("mesh", "lowest"),
    [
        ('{shape="sphere", radius="2 mm", element_size="1 mm", centre=[0, 0, "5 mm"]}', 3e-3),
        ('{shape="plate", width="4 mm", height="4 mm", thickness="2 mm", element_size="1 mm"}', 0.0),
        ('{shape="cylinder", axis="x", radius="2 mm", length="9 mm", element_size="1 mm"}', -2e-3),
        ('{shape="box", low=[0, 0, "1 mm"], high=["1 mm", "1 mm", "2 mm"], element_size="1 mm"}', 1e-3),
    ],
)
def test_a_body_touches_the_wall_and_no_more(mesh: str, lowest: float) -> None:
    at = [f"parts[0].mesh={mesh}", f"boundaries[0].point=[0, 0, {lowest}]", "probes=[]"]
    parse_case(rod(*at))
    assert "behind this wall" in messages(*at, f"boundaries[0].point[2]={lowest + 1e-6}")["boundaries[0]"]


def test_an_oblique_wall_meets_a_cylinder_at_its_rim() -> None:
    at = ["boundaries[0].normal=[0, 1, 1]", "boundaries[0].point=[0, '-3 mm', 0]"]
    parse_case(rod(*at))
    assert "behind this wall" in messages(*at, "boundaries[0].point[1]=-2.99 mm")["boundaries[0]"]


def test_a_mesh_file_is_a_path() -> None:
    file = 'parts[0].mesh={shape="file", unit="1 mm", path="rod.msh"}'
    parse_case(rod(file))
    for path in ("https://example.org/rod.msh", " "):
        assert messages(file, f"parts[0].mesh.path='{path}'") == {
            "parts[0].mesh.path": "expected the path of a mesh file"
        }


def test_melting_lies_above_the_reference_temperature() -> None:
    law = "{model='johnson_cook', A=1, B=1, n=1, C=0, m=1, melt_temperature=200, specific_heat=1}"
    found = messages("materials.m={density=1, elastic={young=1, poisson=0}, strength=" + law + "}")
    assert found == {"materials.m.strength.melt_temperature": "must be above 293.15 K, the reference"}


def test_a_part_that_breaks_before_it_strains_is_refused() -> None:
    """A Johnson-Cook constant D1 below zero is usual, -2.2 for Armco iron: with D2 = 5.43 and D3 = -0.47 the iron
    breaks at a strain of 2.4.
    """
    law = "{{model='johnson_cook', A=1, B=1, n=1, C=0, m=1, melt_temperature=2000, specific_heat=1, damage={}}}"
    steel = "materials.m={{density=1, elastic={{young=1, poisson=0}}, strength={}}}"
    parse_case(rod(steel.format(law.format("{D1=-2.2, D2=5.43, D3=-0.47}"))))
    found = messages(steel.format(law.format("{D1=-2.2, D2=1.0, D3=-0.47}")))
    assert found == {
        "materials.m.strength.damage.D1": "a tensile test would break at a plastic strain of -1.35, D1 + D2 e^(D3/3)"
    }


@pytest.mark.parametrize(
    ("law", "key", "message"),
    [
        ("friction_angle=55", "friction_angle", "'55 deg'"),
        ("friction_angle='90 deg'", "friction_angle", "below 90 deg"),
        ("friction_angle=-0.1", "friction_angle", "at least 0"),
        ("friction_angle='55 deg', residual_cohesion=1", "residual_cohesion", "needs failure_strain"),
        ("friction_angle='55 deg', residual_friction_angle=0.5", "residual_friction_angle", "needs failure_strain"),
        ("friction_angle='55 deg', failure_strain=1, residual_cohesion=11", "residual_cohesion", "above 10 Pa"),
        ("friction_angle='20 deg', failure_strain=1, residual_friction_angle='30 deg'", "residual_friction_angle",
         "above 0.349066 rad"),
        ("friction_angle='20 deg', dilation_angle='21 deg'", "dilation_angle", "above 0.349066 rad, the friction"),
        ("friction_angle='20 deg', strength_cap=0", "strength_cap", "greater than 0"),
    ],
)  # fmt: skip
def test_brittle_strength(law: str, key: str, message: str) -> None:
    strength = f"{{model='mohr_coulomb', cohesion=10, {law}}}"
    found = messages(f"materials.m={{density=1, elastic={{young=1, poisson=0}}, strength={strength}}}")
    assert list(found) == [f"materials.m.strength.{key}"]
    assert message in found[f"materials.m.strength.{key}"]


def test_a_material_with_dilation_has_the_linear_pressure() -> None:
    strength = "{model='mohr_coulomb', cohesion=10, friction_angle='20 deg', dilation_angle='5 deg'}"
    eos = "{model='mie_gruneisen', c0=1, S=1, gamma0=1}"
    found = messages(f"materials.m={{density=1, elastic={{young=1, poisson=0}}, strength={strength}, eos={eos}}}")
    assert list(found) == ["materials.m.eos"]
    assert "linear pressure" in found["materials.m.eos"]


SPIN = "{kind='rotation', spin={centre=[0, 0, 0], rate=[0, 0, '1000 rad/s']}}"


@pytest.mark.parametrize(
    ("first", "second", "axes"),
    [
        ("{kind='velocity', x='1 m/s'}", "{kind='velocity', parts=['rod'], x='2 m/s', z=0}", "'x'"),
        ("{kind='velocity', x='1 m/s', z=0}", "{kind='velocity', x='1 m/s', z=0, course=[[0, 0], [1, 1]]}", "'x'"),
        (SPIN, "{kind='velocity', x='1 m/s', z='1 m/s'}", "'x', 'z'"),
        ("{kind='velocity', y=0}", SPIN, "'y'"),
        (SPIN, SPIN.replace("1000", "1001"), "'x', 'y'"),
    ],
)
def test_a_part_has_one_drive_along_an_axis(first: str, second: str, axes: str) -> None:
    found = messages(f"boundaries=[{first}, {second}]", "parts[0].mesh.sector=full")
    message = f"prescribes the velocity of part 'rod' along {axes}, which boundaries[0] prescribes differently"
    assert found == {"boundaries[1]": f"{message}; keep one of the two"}


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("{kind='velocity', x='1 m/s'}", "{kind='velocity', y='2 m/s'}"),
        ("{kind='velocity', x='1 m/s'}", "{kind='velocity', x='1 m/s', z=0}"),
        ("{kind='velocity', x=0}", "{kind='velocity', x='1 m/s', course=[[0, 0]]}"),
        ("{kind='velocity', z=0}", SPIN),
        ("{kind='velocity', x=0}", "{kind='velocity', x='1 m/s', low=[0, 0, 0], high=[0, 0, 0]}"),
    ],
)
def test_drives_that_agree_or_may_hold_other_nodes_are_sound(first: str, second: str) -> None:
    parse_case(rod(f"boundaries=[{first}, {second}]", "parts[0].mesh.sector=full"))


def test_a_law_that_counts_damage_permits_erosion_by_damage() -> None:
    parse_case(rod("parts[0].material=weldox_460e", "parts[0].erosion={damage=1}"))
