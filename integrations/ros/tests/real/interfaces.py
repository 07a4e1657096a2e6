"""Builds ROS 2 interface packages with the generators of rosidl: from `definitions`, or else from `integrations/ros/interfaces`.

    python interfaces.py PREFIX PACKAGE[/FILE]...

PREFIX is the virtual environment with the wheels of `requirements.txt`; the packages are installed into it. Without FILE (such as
`srv/Task.srv`), all definitions of the package are built. A package is built again only if its definitions have changed.
"""

import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOTS = (HERE / "definitions", HERE.parents[1] / "interfaces")

CMAKE = """cmake_minimum_required(VERSION 3.16)
project({name})
find_package(ament_cmake REQUIRED)
{generators}
{dependencies}
rosidl_generate_interfaces(${{PROJECT_NAME}} {files} {clause})
ament_package()
"""

PACKAGE = """<?xml version="1.0"?>
<package format="3">
  <name>{name}</name><version>0.0.0</version><description>Test interfaces</description>
  <maintainer email="nobody@example.org">nobody</maintainer><license>Apache-2.0</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
  {depends}
  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
</package>
"""

# Generators that rclpy on Fast DDS needs. `rosidl_default_generators` would also generate and compile messages for C++,
# and introspection.
GENERATORS = (
    "rosidl_cmake",
    "rosidl_generator_type_description",
    "rosidl_generator_c",
    "rosidl_generator_cpp",
    "rosidl_typesupport_fastrtps_cpp",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_c",
    "rosidl_generator_py",
)

# Packages that the definitions refer to, in addition to their own.
DEPENDENCIES = {
    "controller_manager_msgs": ["builtin_interfaces"],
    "nav2_msgs": ["action_msgs", "builtin_interfaces", "geometry_msgs", "nav_msgs"],
    "suave_msgs": [],
    "system_modes_msgs": [],
}


def root(name: str) -> pathlib.Path:
    """Directory of a package."""
    return next(directory / name for directory in ROOTS if (directory / name).is_dir())


def definitions(name: str) -> list[pathlib.Path]:
    """Definition files of a package, sorted."""
    folders = [root(name) / kind for kind in ("msg", "srv", "action")]
    return sorted(file for folder in folders if folder.is_dir() for file in folder.iterdir())


def python_headers(prefix: pathlib.Path) -> None:
    """Replaces include directories of the machine that built the wheels: they do not exist here."""
    code = "import sysconfig; print(sysconfig.get_path('include')); print(sysconfig.get_path('purelib'))"
    paths = subprocess.check_output([prefix / "bin/python", "-c", code], text=True).split()
    for file in prefix.glob("share/*/cmake/*.cmake"):
        text = file.read_text()
        local = re.sub(r"/opt/python/[^/;\"]+/include/python3\.\d+", paths[0], text)
        local = re.sub(r"/opt/python/[^/;\"]+/lib/python3\.\d+/site-packages", paths[1], local)
        if local != text:
            file.write_text(local)


def build(prefix: pathlib.Path, name: str, file: str) -> None:
    """Builds and installs one package, or only one definition of it."""
    files = [root(name) / file] if file else definitions(name)
    digest = hashlib.sha256(b"".join(file.name.encode() + file.read_bytes() for file in files)).hexdigest()
    stamp = prefix / "share" / name / "definitions.sha256"
    if stamp.exists() and stamp.read_text() == digest:
        return
    dependencies = DEPENDENCIES[name]
    with tempfile.TemporaryDirectory() as directory:
        source = pathlib.Path(directory)
        for file in files:
            (source / file.parent.name).mkdir(exist_ok=True)
            shutil.copy(file, source / file.parent.name / file.name)
        relative = " ".join(str(file.relative_to(root(name))) for file in files)
        generators, found = (
            "\n".join(f"find_package({package} REQUIRED)" for package in packages) for packages in (GENERATORS, dependencies)
        )
        clause = f"DEPENDENCIES {' '.join(dependencies)}" if dependencies else ""
        text = CMAKE.format(name=name, files=relative, generators=generators, dependencies=found, clause=clause)
        (source / "CMakeLists.txt").write_text(text)
        depends = "".join(f"<depend>{dependency}</depend>" for dependency in dependencies)
        (source / "package.xml").write_text(PACKAGE.format(name=name, depends=depends))
        environment = os.environ | {
            "PATH": f"{prefix / 'bin'}:{os.environ['PATH']}",
            "AMENT_PREFIX_PATH": str(prefix),
            "PYTHONPATH": str(next(prefix.glob("lib/python3*/site-packages"))),
        }

        def cmake(*arguments: str) -> None:
            """Runs CMake; its output is shown only if it fails."""
            run = subprocess.run(["cmake", *arguments], env=environment, capture_output=True, text=True, check=False)
            if run.returncode != 0:
                sys.exit(f"{name}: cmake {' '.join(arguments)}\n{run.stdout}\n{run.stderr}")

        out = str(source / "build")
        options = [f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCMAKE_INSTALL_PREFIX={prefix}", "-DBUILD_TESTING=OFF"]
        # Optimised code would take longer to compile than it saves.
        options += ["-DCMAKE_C_FLAGS=-O0", "-DCMAKE_CXX_FLAGS=-O0"]
        cmake("-S", str(source), "-B", out, *options)
        cmake("--build", out, "-j2")
        cmake("--install", out)
    stamp.write_text(digest)


def main() -> None:
    """Builds the packages that the command line names."""
    prefix = pathlib.Path(sys.argv[1]).resolve()
    python_headers(prefix)
    for argument in sys.argv[2:]:
        name, _, file = argument.partition("/")
        build(prefix, name, file)


if __name__ == "__main__":
    main()
