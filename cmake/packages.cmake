# Debian packages, one a component: cmake --build build/release --target deb (packaging/README.md)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME trunnion)
set(CPACK_PACKAGE_VENDOR Trunnion)
set(CPACK_PACKAGE_CONTACT "Trunnion maintainers <maintainers@trunnion.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL runtime dev panel)
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
set(CPACK_DEBIAN_DEV_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS liblcm-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS "trunnion (= ${PROJECT_VERSION}-1)")
set(CPACK_COMPONENT_DEV_DESCRIPTION "messages of a Trunnion machine for other programs
The messages in which a machine tells its state and motion and takes
commands: as .lcm files for any language that LCM has, and as C++ headers
with a CMake config.")
include(CPack)

add_custom_target(deb COMMAND ${CMAKE_CPACK_COMMAND} --config ${CMAKE_BINARY_DIR}/CPackConfig.cmake -B ${CMAKE_BINARY_DIR}/deb
  DEPENDS trunnion trunnion-drives panel_page VERBATIM)
