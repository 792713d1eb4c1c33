// What this module was built with. CMake says so: each version is the one that find_package found.
#include "versions.hpp"

#include <map>
#include <string>

namespace cdprcal::python {

void register_versions(py::module_& module) {
  module.def(
      "library_versions",
      [] {
        return std::map<std::string, std::string>{
            {"Boost", CDPRCAL_BOOST_VERSION},       {"CGAL", CDPRCAL_CGAL_VERSION},
            {"Ceres", CDPRCAL_CERES_VERSION},       {"Eigen", CDPRCAL_EIGEN_VERSION},
            {"NLopt", CDPRCAL_NLOPT_VERSION},       {"compiler", CDPRCAL_COMPILER_VERSION},
            {"pybind11", CDPRCAL_PYBIND11_VERSION}, {"simdjson", CDPRCAL_SIMDJSON_VERSION},
            {"yaml-cpp", CDPRCAL_YAML_CPP_VERSION}};
      },
      "Versions of the compiler and of the libraries that this module was built with, by name.");
}

}  // namespace cdprcal::python
