"""Build small FMUs with gcc: a gripper of FMI 2 or 3, for model exchange or co-simulation."""

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

SOURCE, REFERENCE = Path(__file__).parent / "fmu_gripper.c", Path(__file__).parent / "fmu_reference.c"
TOKEN = "{8c4e810f-3df3-4a00-8276-176fa3c9f000}"
KINDS = {"cs": ("CoSimulation",), "me": ("ModelExchange",)}


def can_build():
    """Whether gcc and FMPy are installed; the stubs are made from FMPy's list of functions."""
    try:
        import fmpy  # noqa: F401
    except ImportError:
        return False
    return shutil.which("gcc") is not None


def build_fmu(folder, version=2, kind="cs", name="gripper", more=(), platform=None, unit="m", extra=""):
    """Compile the gripper and pack it into an FMU; `more` are options of gcc."""
    library = _compiled(SOURCE, folder, version, name, more)
    here = platform or ("linux64" if version == 2 else "x86_64-linux")
    document = _fmi2(kind, unit, extra) if version == 2 else _fmi3(kind, unit, extra)
    target = folder / f"{name}.fmu"
    with zipfile.ZipFile(target, "w") as packed:
        packed.writestr("modelDescription.xml", document)
        packed.write(library, f"binaries/{here}/gripper{'.dll' if 'win' in here else '.so'}")
    return target


def _compiled(source, folder, version, name, more):
    """Compile a source with stubs for the functions of the standard that it leaves out."""
    import fmpy

    code = source.read_text()
    package = Path(fmpy.__file__).parent
    wanted = set(re.findall(rf"\bfmi{version}[A-Z]\w+", (package / f"c-code/fmi{version}Functions.h").read_text()))
    wanted = {one for one in wanted if not one.endswith("TYPE") and "FullName" not in one}
    missing = sorted(one for one in wanted if not re.search(rf"\b{one}\(", code))
    stubs = folder / "stubs.c"
    stubs.write_text("\n".join(f"int {one}(void) {{ return 3; }}" for one in missing))
    options = ["-shared", "-fPIC", "-O1", "-w", f"-DFMI={version}", *more]
    library = folder / f"{name}.so"
    subprocess.run(["gcc", *options, str(source), str(stubs), "-o", str(library), "-lm"], check=True)
    return library


def pack_fmu2(folder, name, variables, kind, *more):
    """Compile fmu_reference.c as an FMU of FMI 2 with the variables of a document; `more` are options of gcc."""
    library = _compiled(REFERENCE, folder, 2, name, more)
    kinds = "".join(f'<{one} modelIdentifier="{name}"/>' for one in KINDS[kind])
    document = (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<fmiModelDescription fmiVersion="2.0" modelName="{name}" guid="{TOKEN}" numberOfEventIndicators="0">{kinds}'
        f"<ModelVariables>{variables}</ModelVariables><ModelStructure/></fmiModelDescription>"
    )
    target = folder / f"{name}.fmu"
    with zipfile.ZipFile(target, "w") as packed:
        packed.writestr("modelDescription.xml", document)
        packed.write(library, f"binaries/linux64/{name}.so")
    return target


def _fmi2(kind, unit, extra):
    kinds = "".join(f'<{one} modelIdentifier="gripper"/>' for one in KINDS[kind])
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="gripper" guid="{TOKEN}" numberOfEventIndicators="0">
{kinds}
<UnitDefinitions><Unit name="{unit}"/></UnitDefinitions>
<ModelVariables>
<ScalarVariable name="u" valueReference="1" causality="input" variability="continuous">
<Real unit="{unit}" start="0"/></ScalarVariable>
<ScalarVariable name="gap" valueReference="2" causality="output" variability="continuous">
<Real unit="{unit}"/></ScalarVariable>
<ScalarVariable name="x" valueReference="3" causality="local" variability="continuous"><Real/></ScalarVariable>
<ScalarVariable name="v" valueReference="4" causality="local" variability="continuous"><Real/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="5" causality="local" variability="continuous">
<Real derivative="3"/></ScalarVariable>
<ScalarVariable name="der(v)" valueReference="6" causality="local" variability="continuous">
<Real derivative="4"/></ScalarVariable>
{extra}
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/></Outputs>
<Derivatives><Unknown index="5"/><Unknown index="6"/></Derivatives></ModelStructure>
</fmiModelDescription>"""


def _fmi3(kind, unit, extra):
    kinds = "".join(f'<{one} modelIdentifier="gripper"/>' for one in KINDS[kind])
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="gripper" instantiationToken="{TOKEN}">
{kinds}
<UnitDefinitions><Unit name="{unit}"/></UnitDefinitions>
<ModelVariables>
<Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
<Float64 name="u" valueReference="1" causality="input" variability="continuous" unit="{unit}" start="0"/>
<Float64 name="gap" valueReference="2" causality="output" variability="continuous" unit="{unit}"/>
<Float64 name="x" valueReference="3" causality="local" variability="continuous" start="0" initial="exact"/>
<Float64 name="v" valueReference="4" causality="local" variability="continuous" start="0" initial="exact"/>
<Float64 name="der(x)" valueReference="5" causality="local" variability="continuous" derivative="3"/>
<Float64 name="der(v)" valueReference="6" causality="local" variability="continuous" derivative="4"/>
{extra}
</ModelVariables>
<ModelStructure><Output valueReference="2"/>
<ContinuousStateDerivative valueReference="5"/><ContinuousStateDerivative valueReference="6"/></ModelStructure>
</fmiModelDescription>"""
