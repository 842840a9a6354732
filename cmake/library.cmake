# The library for other programs, libtrunnion, and the Python module (docs/library.md). Only the names of
# app/library/trunnion.h are seen from outside.
file(GLOB library_sources CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/app/library/*.cc)
add_library(libtrunnion SHARED ${library_sources})
set_target_properties(libtrunnion PROPERTIES OUTPUT_NAME trunnion VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} LINK_DEPENDS ${CMAKE_SOURCE_DIR}/cmake/library.map)
target_link_libraries(libtrunnion PRIVATE trn_lab)
target_link_options(libtrunnion PRIVATE -Wl,--version-script=${CMAKE_SOURCE_DIR}/cmake/library.map -Wl,--no-undefined)
trn_program_headers(libtrunnion)

set(PYBIND11_FINDPYTHON ON)
set(Python_EXECUTABLE ${PYTHON3})
find_package(pybind11 REQUIRED)
pybind11_add_module(trunnion_python MODULE NO_EXTRAS ${CMAKE_SOURCE_DIR}/app/library/python/module.cc)
set_target_properties(trunnion_python PROPERTIES OUTPUT_NAME trunnion LIBRARY_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/python)
target_compile_options(trunnion_python PRIVATE $<$<CONFIG:Release>:-O1>)
target_include_directories(trunnion_python PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(trunnion_python PRIVATE libtrunnion)
