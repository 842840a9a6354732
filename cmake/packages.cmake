# Debian packages, one a component: cmake --build build/release --target deb (packaging/README.md)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME trunnion)
set(CPACK_PACKAGE_VENDOR Trunnion)
set(CPACK_PACKAGE_CONTACT "Trunnion maintainers <maintainers@trunnion.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL runtime dev panel library python)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(deb ${CMAKE_SOURCE_DIR}/packaging/deb)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME trunnion)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_DEPENDS systemd)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "trunnion-panel, can-utils")
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA
  ${deb}/trunnion/postinst ${deb}/trunnion/prerm ${deb}/trunnion/postrm ${deb}/trunnion/conffiles)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION "real-time CNC interpolator and kinematics kernel
Trunnion reads G-code, plans the motion, and every period sends setpoints
to the drives of a machine: from a three-axis mill to five-axis tables,
heads and hexapods. Drives are CANopen (CiA 402), Modbus or simulated.
.
What is simulated is what the machine runs, bit for bit, and no joint ever
leaves its limits of position, velocity, acceleration and jerk.")

set(CPACK_DEBIAN_PANEL_PACKAGE_NAME trunnion-panel)
set(CPACK_DEBIAN_PANEL_PACKAGE_SECTION misc)
set(CPACK_DEBIAN_PANEL_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PANEL_PACKAGE_DEPENDS "trunnion (= ${PROJECT_VERSION}-1)")
set(CPACK_DEBIAN_PANEL_PACKAGE_CONTROL_EXTRA
  ${deb}/trunnion-panel/postinst ${deb}/trunnion-panel/prerm ${deb}/trunnion-panel/postrm)
set(CPACK_COMPONENT_PANEL_DESCRIPTION "operator's page of a Trunnion machine
The page shows state, positions, the path of the tool, offsets, tools and
alarms in a browser of the machine's computer, and takes all commands.
A service for each machine serves it; its address has a key.")

set(CPACK_DEBIAN_DEV_PACKAGE_NAME trunnion-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(library libtrunnion${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "liblcm-dev, ${library} (= ${PROJECT_VERSION}-1)")
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "trunnion (= ${PROJECT_VERSION}-1)")
set(CPACK_COMPONENT_DEV_DESCRIPTION "library and messages of Trunnion for other programs
The C++ library plans motions for a machine and reads G-code.
.
The messages in which a machine tells its state and motion and takes
commands: as .lcm files for any language that LCM has, and as C++ headers
with a CMake config.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME ${library})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
file(WRITE ${CMAKE_BINARY_DIR}/deb_control/triggers "activate-noawait ldconfig\n")
file(WRITE ${CMAKE_BINARY_DIR}/deb_control/shlibs
  "libtrunnion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} ${library} (>= ${PROJECT_VERSION})\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${CMAKE_BINARY_DIR}/deb_control/triggers ${CMAKE_BINARY_DIR}/deb_control/shlibs)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "motion planning and kinematics of Trunnion, as a library
It reads G-code, plans motions that keep position, velocity, acceleration
and jerk of every joint inside its limits, and knows the kinematics of the
machines that Trunnion drives.")

math(EXPR next_python "${Python_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-trunnion)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${CMAKE_BINARY_DIR})  # where libtrunnion is
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "${library} (= ${PROJECT_VERSION}-1), python3 (>= 3.${Python_VERSION_MINOR}), python3 (<< 3.${next_python}), python3-numpy")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "library of Trunnion for Python
It reads G-code, plans motions for a machine as numpy arrays of setpoints,
knows the machine's kinematics, and fits ball-bar readings.")
include(CPack)

add_custom_target(deb COMMAND ${CMAKE_CPACK_COMMAND} --config ${CMAKE_BINARY_DIR}/CPackConfig.cmake -B ${CMAKE_BINARY_DIR}/deb
  DEPENDS trunnion trunnion-drives libtrunnion trunnion_python panel_page VERBATIM)
