"""Writes small scenes with participating media: every medium, boundary, place of the emitter and phase function, in combinations
of which each pair of choices occurs at least once, rooms filled with fog, and smoke on grids; and the manifest by which tools/compare_media
compares them with Mitsuba.

Usage: media_scenes.py FOLDER
"""

import itertools
import json
import math
import struct
import sys
from pathlib import Path

MEDIA = {
    "thin": '<float name="sigma_t" value="0.6"/><float name="albedo" value="0.8"/>',
    "dense": '<float name="sigma_t" value="6"/><float name="albedo" value="0.95"/>',
    "absorbing": '<float name="sigma_t" value="1.5"/><float name="albedo" value="0"/>',
    "milk": '<float name="sigma_t" value="4"/><rgb name="albedo" value="0.97 0.9 0.7"/>',
    "chromatic": '<rgb name="sigma_t" value="0.15 0.4 0.9"/><float name="scale" value="5"/><float name="albedo" value="0.8"/>',
    "dye": '<rgb name="sigma_t" value="0.9 0.2 0.05"/><float name="scale" value="3"/><rgb name="albedo" value="0.1 0.5 0.7"/>',
}

PHASES = {
    "isotropic": '<phase type="isotropic"/>',
    "forward": '<phase type="hg"><float name="g" value="0.8"/></phase>',
    "backward": '<phase type="hg"><float name="g" value="-0.5"/></phase>',
    "rayleigh": '<phase type="rayleigh"/>',
    "blend": '<phase type="blendphase"><float name="weight" value="0.3"/><phase type="hg"><float name="g" value="0.7"/></phase>'
    '<phase type="rayleigh"/></phase>',
    "table": '<phase type="tabphase"><string name="values" value="0.4, 0.1, 0.2, 0.5, 0.6, 2.5"/></phase>',
    "flakes": '<phase type="sggx"><volume name="S" type="gridvolume"><string name="filename" value="flakes.vol"/></volume></phase>',
}

SPHERE = '<shape type="sphere"><point name="center" x="0" y="0" z="0.8"/><float name="radius" value="0.6"/>'
CUBE = (
    '<shape type="cube"><transform name="to_world"><scale value="0.45"/><rotate x="1" angle="34"/><rotate z="1" angle="20"/>'
    '<translate z="0.8"/></transform>'
)
BOUNDARIES = {
    "null_sphere": SPHERE + '<bsdf type="null"/>',
    "null_cube": CUBE + '<bsdf type="null"/>',
    "glass": SPHERE + '<bsdf type="dielectric"><float name="int_ior" value="1.33"/></bsdf>',
    "rough_glass": SPHERE + '<bsdf type="roughdielectric"><float name="int_ior" value="1.4"/><float name="alpha" value="0.3"/></bsdf>',
    "matched": CUBE + '<bsdf type="dielectric"><float name="int_ior" value="1"/><float name="ext_ior" value="1"/></bsdf>',
    "mask": SPHERE + '<bsdf type="mask"><float name="opacity" value="0.4"/><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf>',
}

LAMP = (
    '<shape type="rectangle"><transform name="to_world"><scale value="{size}"/><rotate y="1" angle="180"/>'
    '<translate x="0.4" y="-0.5" z="{z}"/></transform><emitter type="area"><rgb name="radiance" value="{light}"/></emitter></shape>'
)
EMITTERS = {
    "sky": '<emitter type="constant"><rgb name="radiance" value="0.8 0.9 1"/></emitter>',
    "lamp": LAMP.format(size=0.8, z=3, light="7 6 5"),
    "point": '<emitter type="point"><point name="position" x="1.2" y="-1" z="2.6"/><rgb name="intensity" value="6 6 7"/></emitter>',
    "sun": '<emitter type="directional"><vector name="direction" x="0.4" y="0.3" z="-1"/><rgb name="irradiance" value="3 3 2.5"/></emitter>',
    "inside": '<shape type="sphere"><point name="center" x="0.1" y="-0.05" z="0.85"/><float name="radius" value="0.12"/>'
    '{around}<emitter type="area"><rgb name="radiance" value="9 8 7"/></emitter></shape>',
}

MANIFEST = """# Of tools/media_scenes.py: {count} scenes with media against Mitsuba 3.
[renderer.mitsuba]
command = [{mitsuba}, {script}, "{{scene}}", "-o", "{{output}}", "--seed", "{{seed}}", "--spp", "{{spp}}"]

[tolerance.tables]
relative = 0.003

[[case]]
scene = "*.xml"
# The directions that sggx of Mitsuba 3.9 samples do not follow its own density: a white furnace, σₜ 2, shows .93 (volpathmis, scalar_spectral).
except = {flakes}
devices = ["cpu"]
options = ["--filter", "box"]
spp = 64
seeds = 12
most_seeds = 48
detect = 0.01
tolerance = "tables"
against = "mitsuba"
"""

SCENE = """<scene version="3.0.0">
<integrator type="{integrator}"><integer name="max_depth" value="{depth}"/><integer name="rr_depth" value="50"/></integrator>
<sensor type="perspective"><float name="fov" value="32"/>{camera}
<film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="24"/><rfilter type="box"/></film></sensor>
{medium}
<shape type="rectangle"><transform name="to_world"><scale value="4"/></transform><bsdf type="twosided"><bsdf type="diffuse">
<rgb name="reflectance" value="0.6 0.55 0.5"/></bsdf></bsdf>{floor}</shape>
{boundary}
{emitter}
</scene>
"""

LOOK = '<transform name="to_world"><lookat origin="{origin}" target="0, 0, 0.75" up="0, 0, 1"/></transform>'


def text(medium, boundary, emitter, phase):
    """A floor and a body of the medium."""
    chromatic = medium in ("chromatic", "dye")
    inside = '<ref name="interior" id="fog"/>'
    around = '<ref name="exterior" id="fog"/>'
    return SCENE.format(
        integrator="volpathmis" if chromatic else "volpath",
        depth=40 if medium in ("dense", "milk") else 16,
        camera=LOOK.format(origin="0, -4, 1.6"),
        medium=f'<medium type="homogeneous" id="fog">{MEDIA[medium]}{PHASES[phase]}</medium>',
        floor="",
        boundary=BOUNDARIES[boundary] + inside + "</shape>",
        emitter=EMITTERS[emitter].format(around=around) if emitter == "inside" else EMITTERS[emitter],
    )


def room(medium, phase, emitter):
    """A box of the medium around camera, floor, body and lamp."""
    fog = '<ref name="interior" id="fog"/>'
    box = f'<shape type="cube"><transform name="to_world"><scale value="4.5"/></transform><bsdf type="null"/>{fog}</shape>'
    ball = '<shape type="sphere"><point name="center" x="0" y="0" z="0.6"/><float name="radius" value="0.6"/>{}</shape>'
    bsdf = '<bsdf type="dielectric"/><ref name="exterior" id="fog"/>' if medium == "thin" else '<bsdf type="diffuse"/>'
    chromatic = medium in ("chromatic", "dye")
    weak = MEDIA[medium] if medium == "thin" else MEDIA[medium].replace('"5"', '"0.5"').replace('"4"', '"0.4"').replace('"3"', '"0.3"')
    return SCENE.format(
        integrator="volpathmis" if chromatic else "volpath",
        depth=12,
        camera=LOOK.format(origin="0, -3.5, 1.6") + '<ref id="fog"/>',
        medium=f'<medium type="homogeneous" id="fog">{weak}{PHASES[phase]}</medium>',
        floor="",
        boundary=box + ball.format(bsdf),
        emitter=EMITTERS[emitter],
    )


def write_grid(path, size, channels, values):
    header = struct.pack("<3sB5i6f", b"VOL", 3, 1, *size, channels, 0, 0, 0, 1, 1, 1)
    path.write_bytes(header + struct.pack(f"<{len(values)}f", *values))


def flakes(folder):
    """The matrix of flat flakes that lie askew, and fibres that turn from one end of a grid to the other."""
    write_grid(folder / "flakes.vol", [1, 1, 1], 6, [0.3, 0.5, 0.8, 0.1, -0.2, 0.3])
    turning = []
    for i in range(9):
        c, s = math.cos(0.2 * i), math.sin(0.2 * i)
        turning += [0.1 + 0.8 * s * s, 0.1 + 0.8 * c * c, 0.9, -0.8 * s * c, 0, 0]
    write_grid(folder / "fibres.vol", [1, 1, 9], 6, turning)


def smoke(folder):
    """Two grids: a density that billows upwards, and an albedo in colours."""
    size = 24
    density, albedo = [], []
    for z, y, x in itertools.product(range(size), repeat=3):
        p = [(v + 0.5) / size for v in (x, y, z)]
        bend = 0.12 * math.sin(7 * p[2])
        radius = math.hypot(p[0] - 0.5 - bend, p[1] - 0.5 + 0.08 * math.cos(9 * p[2]))
        billow = 0.5 + 0.5 * math.sin(23 * p[0] + 5 * math.sin(17 * p[2])) * math.sin(19 * p[1])
        density.append(max(0.0, 1 - radius / (0.1 + 0.25 * p[2])) * billow)
        albedo += [0.9, 0.5 + 0.4 * p[2], 0.3 + 0.6 * p[0]]
    for name, channels, values in (("density", 1, density), ("albedo", 3, albedo)):
        write_grid(folder / f"{name}.vol", [size] * 3, channels, values)


def on_grid(name, channels="density", phase="isotropic", emitter="sky", scale="12", albedo=None):
    """Smoke on a grid in a turned box."""
    turned = '<rotate z="1" angle="25"/><scale x="1.4" y="1.2" z="1.6"/><translate z="0.05"/></transform>'
    place = '<transform name="to_world"><translate x="-0.5" y="-0.5"/>' + turned
    box = '<shape type="cube"><transform name="to_world"><scale value="0.5"/><translate z="0.5"/>' + turned
    grid = '<volume name="{}" type="gridvolume"><string name="filename" value="{}.vol"/>' + place + "</volume>"
    albedo = albedo or '<float name="albedo" value="0.8"/>'
    albedo = grid.format("albedo", "albedo") if albedo == "grid" else albedo
    medium = (
        f'<medium type="heterogeneous" id="fog">{grid.format("sigma_t", channels)}{albedo}<float name="scale" value="{scale}"/>'
        f"{PHASES[phase].replace('flakes.vol', 'fibres.vol')}</medium>"
    )
    return SCENE.format(
        integrator="volpathmis",
        depth=30,
        camera=LOOK.format(origin="0, -4, 1.6"),
        medium=medium,
        floor="",
        boundary=box + '<bsdf type="null"/><ref name="interior" id="fog"/></shape>',
        emitter=EMITTERS[emitter],
    )


def scatters_by_flakes(name):
    """Whether microflakes scatter light in the scene of this name."""
    return any(word in name for word in ("flakes", "fibres")) and not name.startswith("absorbing")


def combinations():
    """Combinations in which every pair of choices of different kinds occurs, found greedily."""
    kinds = [list(MEDIA), list(BOUNDARIES), list(EMITTERS), list(PHASES)]
    everything = list(itertools.product(*kinds))
    pairs = lambda c: {(i, j, c[i], c[j]) for i, j in itertools.combinations(range(4), 2)}
    open_pairs = set().union(*map(pairs, everything))
    while open_pairs:
        best = max(everything, key=lambda c: len(pairs(c) & open_pairs))
        open_pairs -= pairs(best)
        yield best


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for old in folder.glob("*.[xv][mo]l"):
        old.unlink()
    scenes = {"-".join(c): text(*c) for c in combinations()}
    for medium, phase, emitter in [
        ("thin", "forward", "lamp"),
        ("thin", "rayleigh", "sky"),
        ("chromatic", "isotropic", "lamp"),
        ("milk", "backward", "point"),
        ("dye", "blend", "lamp"),
    ]:
        scenes[f"room-{medium}-{emitter}-{phase}"] = room(medium, phase, emitter)
    flakes(folder)
    smoke(folder)
    scenes["smoke-sky-isotropic"] = on_grid("smoke")
    scenes["smoke-lamp-forward"] = on_grid("smoke", phase="forward", emitter="lamp", scale="30")
    scenes["smoke-point-milky"] = on_grid("smoke", emitter="point", albedo='<rgb name="albedo" value="0.95 0.8 0.5"/>')
    scenes["smoke-sun-albedo_grid"] = on_grid("smoke", emitter="sun", albedo="grid")
    scenes["smoke-lamp-fibres"] = on_grid("smoke", phase="flakes", emitter="lamp", scale="20")
    for name, scene in scenes.items():
        (folder / f"{name}.xml").write_text(scene)
    tools = Path(__file__).resolve().parent
    words = [json.dumps(str(tools / name)) for name in ("mitsuba", "mitsuba_scene.py")]
    flakes_only = json.dumps([name for name in scenes if scatters_by_flakes(name)])
    manifest = MANIFEST.format(count=len(scenes), mitsuba=words[0], script=words[1], flakes=flakes_only)
    (folder / "regress.toml").write_text(manifest)
    print(f"{len(scenes)} scenes in {folder}")


if __name__ == "__main__":
    main()
