# The ctest entry "consumer"; see ../CMakeLists.txt for the variables.
set(prefix "${WORK_DIR}/prefix")
set(build "${WORK_DIR}/build")
file(REMOVE_RECURSE "${WORK_DIR}")

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}" --component cpp)

# Every installed header has all that it includes; main.cpp shows that the important ones were installed.
file(GLOB_RECURSE headers RELATIVE "${prefix}/include" "${prefix}/include/*.hpp")
list(TRANSFORM headers REPLACE "(.+)" "#include <\\1>\n")
string(JOIN "" all_headers ${headers})
file(WRITE "${build}/all_headers.cpp" "${all_headers}")

if(SANITIZE)
  set(CXX_FLAGS "${CXX_FLAGS} -fsanitize=${SANITIZE}")
endif()
run("${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}" -B "${build}" -G "${GENERATOR}" "-DCMAKE_PREFIX_PATH=${prefix}"
    "-DCMAKE_CXX_COMPILER=${CXX_COMPILER}" "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}")
run("${CMAKE_COMMAND}" --build "${build}")
run("${build}/consumer")

# The installed programs find the installed library.
file(GLOB programs "${prefix}/bin/cdprcal-*")
foreach(program IN LISTS programs)
  run("${program}" --help)
endforeach()
