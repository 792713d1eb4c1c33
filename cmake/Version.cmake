# Sets CDPRCAL_VERSION from pyproject.toml, the one home of the version.
set(_pyproject "${CMAKE_CURRENT_LIST_DIR}/../pyproject.toml")
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${_pyproject}")

file(STRINGS "${_pyproject}" _version_line REGEX "^version = \"[0-9]+\\.[0-9]+\\.[0-9]+\"" LIMIT_COUNT 1)
if(NOT _version_line MATCHES "\"([0-9]+\\.[0-9]+\\.[0-9]+)\"")
  message(FATAL_ERROR "${_pyproject} has no line of the form: version = \"1.2.3\"")
endif()
set(CDPRCAL_VERSION "${CMAKE_MATCH_1}")

unset(_pyproject)
unset(_version_line)
