# Runs at install time and installs the public headers of SOURCE_DIRS into INCLUDE_DIR.
#
# A header stays home if it includes a private dependency of the library, if it says in its first line that it is
# private ("// Private to model/: ..."), or if it includes a header that stays home. Whoever uses the installed library
# has Eigen and the standard library, nothing else.
cmake_policy(VERSION 3.25)

set(private_dependencies "boost|ceres|CGAL|CLI|glog|gtest|nlohmann|nlopt|pybind11|simdjson|yaml-cpp")

set(public "")
set(private "")
foreach(source_dir IN LISTS SOURCE_DIRS)
  file(GLOB_RECURSE headers RELATIVE "${source_dir}" "${source_dir}/cdprcal/*.hpp")
  foreach(header IN LISTS headers)
    set(origin_${header} "${source_dir}")
    file(STRINGS "${source_dir}/${header}" first_line LIMIT_COUNT 1)
    file(STRINGS "${source_dir}/${header}" includes REGEX "^ *# *include")
    list(TRANSFORM includes REPLACE ".*[<\"](.*)[>\"].*" "\\1")
    set(includes_${header} "${includes}")
    if(first_line MATCHES "^// Private to" OR includes MATCHES "(^|;)(${private_dependencies})[./]")
      list(APPEND private "${header}")
    else()
      list(APPEND public "${header}")
    endif()
  endforeach()
endforeach()

set(changed TRUE)
while(changed)
  set(changed FALSE)
  foreach(header IN LISTS public)
    foreach(included IN LISTS includes_${header})
      if(included IN_LIST private)
        list(REMOVE_ITEM public "${header}")
        list(APPEND private "${header}")
        set(changed TRUE)
        break()
      endif()
    endforeach()
  endforeach()
endwhile()

foreach(header IN LISTS public)
  cmake_path(GET header PARENT_PATH directory)
  file(INSTALL DESTINATION "${INCLUDE_DIR}/${directory}" TYPE FILE FILES "${origin_${header}}/${header}")
endforeach()
