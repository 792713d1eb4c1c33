# Defaults for building cdprcal by itself. A project that adds cdprcal as a subdirectory keeps its own.

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type, Release when none is given" FORCE)
endif()

set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# ccache is used when it is there. With the base directory set, a second clone of the sources hits the same entries; the
# price is that ccache makes paths relative, __FILE__ among them. Of precompiled headers it knows nothing unless it may take
# their macros for granted.
find_program(CDPRCAL_CCACHE ccache)
mark_as_advanced(CDPRCAL_CCACHE)
if(CDPRCAL_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CDPRCAL_CCACHE_ABSOLUTE ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${CDPRCAL_CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} ${CDPRCAL_CCACHE_ABSOLUTE})
endif()

if(CDPRCAL_SANITIZE)
  add_compile_options(-fsanitize=${CDPRCAL_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${CDPRCAL_SANITIZE})
endif()
