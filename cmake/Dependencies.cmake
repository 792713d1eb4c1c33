# Everything the library needs, found once. Only Eigen is public; the rest stays inside the library.
set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Boost 1.74 CONFIG REQUIRED) # Boost.Math, headers only
find_package(Ceres 2.1 REQUIRED)
find_package(NLopt 2.7 REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(simdjson 3.0 REQUIRED)

# yaml-cpp renamed its target in 0.8.
if(NOT TARGET yaml-cpp::yaml-cpp)
  add_library(cdprcal_yaml_cpp INTERFACE)
  target_link_libraries(cdprcal_yaml_cpp INTERFACE yaml-cpp)
  add_library(yaml-cpp::yaml-cpp ALIAS cdprcal_yaml_cpp)
endif()

# Debian's Ceres is static and asks for ATLAS and SuiteSparse, for solvers that are never chosen: cpp/unused_solvers.cpp
# stands for what it would call there. Another Ceres is taken as it is.
get_target_property(ceres_type Ceres::ceres TYPE)
set(CDPRCAL_LEAVES_SOLVERS_OUT OFF)
if(ceres_type STREQUAL "STATIC_LIBRARY" AND Ceres_VERSION VERSION_LESS 2.2)
  set(CDPRCAL_LEAVES_SOLVERS_OUT ON)
  set_target_properties(Ceres::ceres PROPERTIES INTERFACE_LINK_LIBRARIES
                                                "Threads::Threads;glog::glog;gflags;Eigen3::Eigen")
endif()
