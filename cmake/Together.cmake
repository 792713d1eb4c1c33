# Compiles several source files of a folder as one, where the whole tree is compiled once: what they share, Eigen's
# templates above all, then costs its time once, and so do the headers named, which nearly each of them includes. Whoever
# changes single files compiles them one by one.
#
# Files of one folder see each other's unnamed namespaces so: a name is used once in a folder.
function(cdprcal_compile_together target)
  if(NOT CDPRCAL_COMPILE_TOGETHER)
    return()
  endif()
  target_precompile_headers(${target} PRIVATE ${ARGN})
  # Without it ccache cannot see into them.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
  set(most 8) # a compiler takes 2 GB for them
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    cmake_path(GET source PARENT_PATH folder)
    string(MAKE_C_IDENTIFIER "${folder}" folder)
    list(APPEND in_${folder} "${source}")
    list(LENGTH in_${folder} number)
    math(EXPR group "(${number} - 1) / ${most}")
    set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${folder}_${group}")
  endforeach()
endfunction()
