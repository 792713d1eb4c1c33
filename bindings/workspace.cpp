// workspace/: static workspace, alpha shape and meshes.
#include "cdprcal/workspace/workspace.hpp"

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <optional>

#include "bindings.hpp"
#include "cdprcal/workspace/inscribed_box.hpp"
#include "cdprcal/workspace/mesh_file.hpp"
#include "cdprcal/workspace/workspace_shape.hpp"
#include "progress.hpp"

namespace cdprcal::python {
namespace {

using Faces = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;

std::vector<Vector3> to_points(const Eigen::MatrixX3d& rows) {
  std::vector<Vector3> points;
  points.reserve(static_cast<std::size_t>(rows.rows()));
  for (Eigen::Index i = 0; i < rows.rows(); ++i) points.emplace_back(rows.row(i));
  return points;
}

Mesh make_mesh(const Eigen::MatrixX3d& vertices_m, const Eigen::MatrixX3i& faces) {
  Mesh mesh{to_points(vertices_m), {}};
  for (Eigen::Index i = 0; i < faces.rows(); ++i) {
    if (faces.row(i).minCoeff() < 0 || faces.row(i).maxCoeff() >= vertices_m.rows()) {
      throw InputError("faces: row " + std::to_string(i) +
                       " names a vertex that does not exist; correct it");
    }
    mesh.faces.push_back({faces(i, 0), faces(i, 1), faces(i, 2)});
  }
  return mesh;
}

void register_box(py::module_& module) {
  module.def(
      "even_step_m", &even_step_m, py::arg("box"), py::arg("points"),
      "Step [m] of a grid of about so many points in a box; in a flat one as many along a side.");
  module.def(
      "workspace_box", &workspace_box, py::arg("robot"),
      "Where a suspended platform may be: the pulleys' horizontal rectangle, down from the "
      "highest pulley by its larger side, not below the floor; down to the lowest pulley where "
      "cables of six or more pull from below, too.");
  py::class_<Grid>(module, "Grid", "Points at equal steps in all directions. Immutable.")
      .def_readonly("box", &Grid::box)
      .def_property_readonly(
          "origin_m", [](const Grid& g) { return g.origin_m; }, "Point of index (0, 0, 0) [3].")
      .def_readonly("step_m", &Grid::step_m)
      .def_readonly("count", &Grid::count, "[3] along x, y, z.")
      .def_property_readonly("size", &Grid::size);
}

void register_mesh(py::module_& module) {
  py::class_<Mesh>(module, "Mesh",
                   "Closed surface of triangles, counter-clockwise seen from "
                   "outside. Immutable.")
      .def(py::init(&make_mesh), py::arg("vertices_m"), py::arg("faces"),
           "vertices_m [v, 3], faces [f, 3].")
      .def_property_readonly(
          "vertices_m", [](const Mesh& m) { return to_rows(m.vertices_m); }, "[v, 3]; a copy.")
      .def_property_readonly(
          "faces",
          [](const Mesh& m) {
            Faces faces(m.faces.size(), 3);
            for (std::size_t i = 0; i < m.faces.size(); ++i) {
              faces.row(static_cast<Eigen::Index>(i)) << m.faces[i][0], m.faces[i][1],
                  m.faces[i][2];
            }
            return faces;
          },
          "Vertex indices [f, 3]; a copy.")
      .def_property_readonly(
          "watertight", [](const Mesh& m) { return is_watertight(m); },
          "Every edge belongs to exactly two faces that run along it in "
          "opposite directions.")
      .def_property_readonly("volume_m3", &mesh_volume_m3)
      .def_property_readonly("area_m2", &mesh_area_m2)
      .def(
          "contains",
          [](const Mesh& m, const Vector3& position_m) { return contains(m, position_m); },
          py::arg("position_m"), "Inclusion by the winding number.")
      .def(
          "cross_section",
          [](const Mesh& m, double height_m) {
            std::vector<Eigen::MatrixX2d> polygons;
            for (const Polygon& polygon : cross_section(m, height_m)) {
              Eigen::MatrixX2d rows(polygon.size(), 2);
              for (std::size_t i = 0; i < polygon.size(); ++i) {
                rows.row(static_cast<Eigen::Index>(i)) = polygon[i];
              }
              polygons.push_back(rows);
            }
            return polygons;
          },
          py::arg("height_m"),
          "Closed polygons [k, 2] at z = height_m: outer ones counter-clockwise, holes clockwise.");
  WordEnum<MeshEncoding>(module, "MeshEncoding", "Of a mesh file.")
      .value("binary", MeshEncoding::binary)
      .value("ascii", MeshEncoding::ascii)
      .finalize();
  module.def(
      "write_mesh",
      [](const std::filesystem::path& path, const Mesh& mesh, MeshEncoding encoding) {
        write_mesh(path, mesh, encoding);
      },
      py::arg("path"), py::arg("mesh"),
      py::arg_v("encoding", MeshEncoding::binary, "MeshEncoding.binary"),
      "Writes .ply (double precision) or .stl (single). Raises InputError.");
  py::class_<AlphaShape>(module, "AlphaShape", "Boundary of a set of points. Immutable.")
      .def_readonly("mesh", &AlphaShape::mesh)
      .def_readonly("alpha_m2", &AlphaShape::alpha_m2, "Used; squared radius.")
      .def_readonly("components", &AlphaShape::components, "Pieces of the solid.")
      .def_readonly("points_outside", &AlphaShape::points_outside)
      .def_readonly("volume_m3", &AlphaShape::volume_m3)
      .def_readonly("watertight", &AlphaShape::watertight);
  module.def(
      "alpha_shape",
      [](const Eigen::MatrixX3d& points_m, std::optional<double> alpha_m2) {
        AlphaShapeOptions options;
        options.alpha_m2 = alpha_m2;
        const std::vector<Vector3> points = to_points(points_m);
        const py::gil_scoped_release release;
        return alpha_shape(points, options);
      },
      py::arg("points_m"), py::arg("alpha_m2") = py::none(),
      "Alpha shape of points [m, 3]; alpha (a squared radius) is automatic unless given. Raises "
      "InputError for points that are not finite or an alpha that is not positive.");
}

void register_workspace_results(py::module_& module) {
  py::native_enum<PointStatus>(module, "PointStatus", "enum.IntEnum",
                               "What is known about a grid point. untested: the flood never "
                               "reached its neighbourhood.")
      .value("untested", PointStatus::untested)
      .value("inside", PointStatus::inside)
      .value("infeasible", PointStatus::infeasible)
      .value("unstable", PointStatus::unstable)
      .value("no_equilibrium", PointStatus::no_equilibrium)
      .value("obstructed", PointStatus::obstructed)
      .finalize();
  py::setattr(module.attr("PointStatus"), "__str__",
              py::cpp_function([](const py::object& self) { return self.attr("name"); },
                               py::name("__str__"), py::is_method(module.attr("PointStatus"))));
  py::class_<WorkspaceProgress>(module, "WorkspaceProgress", "How far the flood has come.")
      .def_readonly("tested", &WorkspaceProgress::tested)
      .def_readonly("inside", &WorkspaceProgress::inside)
      .def_readonly("total", &WorkspaceProgress::total, "Points of the grid: an upper bound.");
  py::class_<Workspace>(module, "Workspace", "Static workspace on a grid. Immutable.")
      .def_readonly("robot", &Workspace::robot, "With the effects it listed applied.")
      .def_readonly("grid", &Workspace::grid)
      .def_readonly("complete", &Workspace::complete, "False: it was stopped, and is partial.")
      .def_property_readonly(
          "status",
          [](const Workspace& w) {
            const auto& n = w.grid.count;
            py::array_t<std::uint8_t> status({n[2], n[1], n[0]});
            std::transform(w.status.begin(), w.status.end(), status.mutable_data(),
                           [](PointStatus s) { return static_cast<std::uint8_t>(s); });
            return status;
          },
          "PointStatus values [n_z, n_y, n_x]; a copy.")
      .def_readonly("points_tested", &Workspace::points_tested)
      .def_property_readonly("points_inside", &Workspace::points_inside)
      .def_property_readonly(
          "inside_m",
          [](const Workspace& w) {
            Points points(w.inside.size(), 3);
            for (std::size_t row = 0; row < w.inside.size(); ++row) {
              points.row(static_cast<Eigen::Index>(row)) = w.position_m(row);
            }
            return points;
          },
          "Grid points inside [m, 3]; a copy.")
      .def_property_readonly(
          "quaternion_wxyz",
          [](const Workspace& w) {
            Eigen::MatrixXd rows(w.rotation.size(), 4);
            for (std::size_t row = 0; row < w.rotation.size(); ++row) {
              const Eigen::Quaterniond& q = w.rotation[row];
              rows.row(static_cast<Eigen::Index>(row)) << q.w(), q.x(), q.y(), q.z();
            }
            return rows;
          },
          "Equilibrium orientation at each point inside [m, 4]; a copy.")
      .def_property_readonly(
          "tension_N",
          [](const Workspace& w) {
            const int n = w.robot.cable_count();
            return Eigen::MatrixXd(
                Eigen::Map<
                    const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
                    w.tension_N.data(), static_cast<Eigen::Index>(w.inside.size()), n));
          },
          "Tensions at each point inside [m, n]; a copy.")
      .def_property_readonly(
          "boundary_m", [](const Workspace& w) { return to_rows(w.boundary_m); },
          "Points inside, close to the boundary [b, 3]; a copy.")
      .def("__repr__", [](const Workspace& w) {
        return "Workspace(" + std::to_string(w.points_inside()) + " of " +
               std::to_string(w.grid.size()) + " points inside" +
               (w.complete ? ")" : ", not complete)");
      });
}

/// Ctrl-C keeps what was found, as the progress callback's False does.
Workspace compute(const Robot& robot, const std::optional<Box>& box, double step_m,
                  TensionDistribution distribution, const Eigen::VectorXd& lambda_N,
                  StabilityNotion stability, const std::optional<Matrix3>& rotation,
                  const std::optional<Eigen::MatrixX3d>& seeds_m, int threads,
                  int boundary_halvings, const ProgressCallback<WorkspaceProgress>& progress) {
  WorkspaceOptions options;
  options.box = box;
  options.step_m = step_m;
  options.inverse.distribution = distribution;
  options.inverse.lambda_N = to_cable_vector(lambda_N, "lambda_N");
  options.inverse.stability = stability;
  if (rotation) options.inverse.rotation = rotation_from_matrix(*rotation);
  if (seeds_m) options.seeds_m = to_points(*seeds_m);
  options.threads = threads;
  options.boundary_halvings = boundary_halvings;
  Progress ask(progress);
  options.progress = [&ask](const WorkspaceProgress& p) { return ask(p); };
  Workspace workspace;
  {
    const py::gil_scoped_release release;
    workspace = compute_workspace(robot, options);
  }
  try {
    ask.rethrow();
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_KeyboardInterrupt)) throw;
  }
  return workspace;
}

void register_functions(py::module_& module) {
  const WorkspaceOptions usual;
  module.def(
      "compute_workspace", &compute, py::arg("robot"), py::kw_only(), py::arg("box") = py::none(),
      py::arg("step_m") = usual.step_m,
      py::arg_v("distribution", TensionDistribution::barycentre, "TensionDistribution.barycentre"),
      py::arg("lambda_N") = Eigen::VectorXd(),
      py::arg_v("stability", StabilityNotion::locked_lengths, "StabilityNotion.locked_lengths"),
      py::arg("rotation") = py::none(), py::arg("seeds_m") = py::none(),
      py::arg("threads") = usual.threads, py::arg("boundary_halvings") = usual.boundary_halvings,
      py::arg("progress") = py::none(),
      "Floods outward from seeds_m [s, 3] (default: a lattice in the box), each point warm-started "
      "from a solved neighbour. box: default workspace_box. threads: 0 is one a core. "
      "progress(WorkspaceProgress): False stops. Stopped so, or by Ctrl-C, the workspace is what "
      "was found until then and `complete` is False. The robot's known effects are applied. Raises "
      "InputError for a bad box, step or seed, and unless 3 ≤ n ≤ 5.");
  module.def("explain_empty", &explain_empty, py::arg("workspace"),
             "Why nothing is inside, in one sentence; '' when something is.");
  module.def("probe", &probe, py::arg("workspace"), py::arg("position_m"),
             "Everything about one position [3]: equilibrium, and margin_N to the tension limits.");
  module.def("in_solid_cell", &in_solid_cell, py::arg("workspace"), py::arg("position_m"),
             "Whether the grid cell around a position has all its corners inside.");
  module.def("workspace_shape", &workspace_shape, py::arg("workspace"),
             py::arg("alpha_m2") = py::none(), py::call_guard<py::gil_scoped_release>(),
             "The boundary as a watertight mesh; alpha_m2 is automatic unless given.");
  module.def("largest_inscribed_box", &largest_inscribed_box, py::arg("workspace"),
             py::call_guard<py::gil_scoped_release>(),
             "The axis-aligned box of largest volume whose grid points are all inside, or None.");
  module.def("box_is_inside", &box_is_inside, py::arg("workspace"), py::arg("box"),
             "Whether every grid cell that a box touches has all its corners inside.");
}

}  // namespace

void register_workspace(py::module_& module) {
  register_box(module);
  register_mesh(module);
  register_workspace_results(module);
  register_functions(module);
}

}  // namespace cdprcal::python
