// Meshes: checks, volume, inclusion, sections, files.
#include "cdprcal/workspace/mesh.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "cdprcal/error.hpp"
#include "cdprcal/workspace/mesh_file.hpp"
#include "shapes.hpp"

namespace cdprcal {
namespace {

using namespace test;  // NOLINT: test vocabulary

/// A box of 1 × 2 × 3 m with a void of 0.5 m in it.
Mesh hollow_box() {
  Mesh mesh;
  add_box(mesh, {0, 0, 0}, {1, 2, 3});
  add_box(mesh, {0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}, true);
  return mesh;
}

TEST(Mesh, VolumeAndAreaOfAHollowBox) {
  const Mesh mesh = hollow_box();
  EXPECT_TRUE(is_watertight(mesh));
  EXPECT_NEAR(mesh_volume_m3(mesh), 6.0 - 0.125, 1e-12);
  EXPECT_NEAR(mesh_area_m2(mesh), 22.0 + 1.5, 1e-12);
}

TEST(Mesh, WhatIsNotWatertightIsSaid) {
  std::string why;
  EXPECT_FALSE(is_watertight({}, &why));
  Mesh open = hollow_box();
  open.faces.pop_back();
  EXPECT_FALSE(is_watertight(open, &why));
  EXPECT_EQ(why, "an edge is open");
  Mesh flipped = hollow_box();
  std::swap(flipped.faces[3][0], flipped.faces[3][1]);
  EXPECT_FALSE(is_watertight(flipped, &why));
  Mesh twice = hollow_box();
  twice.faces.push_back(twice.faces[0]);
  EXPECT_FALSE(is_watertight(twice, &why));
  Mesh wild = hollow_box();
  wild.faces[0][0] = 99;
  EXPECT_FALSE(is_watertight(wild, &why));
  EXPECT_NE(why.find("does not exist"), std::string::npos);
}

TEST(Mesh, ContainsWhatIsInsideAndNotTheVoid) {
  const Mesh mesh = hollow_box();
  EXPECT_TRUE(contains(mesh, {0.5, 1.5, 1.5}));
  EXPECT_TRUE(contains(mesh, {0.1, 0.1, 0.1}));
  EXPECT_FALSE(contains(mesh, {0.5, 0.5, 0.5}));
  EXPECT_FALSE(contains(mesh, {-0.1, 1.0, 1.0}));
  EXPECT_FALSE(contains(mesh, {0.5, 1.0, 3.001}));
  EXPECT_FALSE(contains({}, {0, 0, 0}));
}

double section_area(const Mesh& mesh, double height) {
  double area = 0.0;
  for (const Polygon& p : cross_section(mesh, height)) area += polygon_area_m2(p);
  return area;
}

TEST(CrossSection, HasTheRightAreaAndHoles) {
  const Mesh mesh = hollow_box();
  EXPECT_EQ(cross_section(mesh, 0.1).size(), 1U);
  EXPECT_NEAR(section_area(mesh, 0.1), 2.0, 1e-9);
  EXPECT_EQ(cross_section(mesh, 0.5).size(), 2U);
  EXPECT_NEAR(section_area(mesh, 0.5), 2.0 - 0.25, 1e-9);
  EXPECT_TRUE(cross_section(mesh, -0.1).empty());
  EXPECT_TRUE(cross_section(mesh, 3.1).empty());
  EXPECT_TRUE(cross_section(mesh, kNaN).empty());
  EXPECT_TRUE(cross_section({}, 0.0).empty());
}

TEST(CrossSection, ThroughVerticesStillCloses) {
  const Mesh mesh = hollow_box();
  EXPECT_NEAR(section_area(mesh, 0.0), 2.0, 1e-9);    // the bottom itself
  EXPECT_NEAR(section_area(mesh, 3.0), 2.0, 1e-9);    // the top
  EXPECT_NEAR(section_area(mesh, 0.25), 1.75, 1e-9);  // the floor of the void
}

class MeshFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() /
              ("cdprcal_mesh_" +
               std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::string written(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
  }
  std::filesystem::path folder_;
};

TEST_F(MeshFile, PlyComesBackExactly) {
  Mesh mesh = hollow_box();
  for (Vector3& v : mesh.vertices_m) v += Vector3(1.0 / 3.0, 1e-7, -kPi);
  for (const MeshEncoding encoding : {MeshEncoding::binary, MeshEncoding::ascii}) {
    write_mesh(path("m.ply"), mesh, encoding);
    const Mesh back = read_mesh(path("m.ply"));
    EXPECT_EQ(back.faces, mesh.faces);
    EXPECT_EQ(back.vertices_m, mesh.vertices_m);
  }
}

TEST_F(MeshFile, StlComesBackToSinglePrecision) {
  const Mesh mesh = hollow_box();
  for (const MeshEncoding encoding : {MeshEncoding::binary, MeshEncoding::ascii}) {
    write_mesh(path("m.STL"), mesh, encoding);
    const Mesh back = read_mesh(path("m.STL"));
    EXPECT_EQ(back.faces.size(), mesh.faces.size());
    EXPECT_EQ(back.vertices_m.size(), mesh.vertices_m.size());
    EXPECT_TRUE(is_watertight(back));
    EXPECT_NEAR(mesh_volume_m3(back), mesh_volume_m3(mesh), 1e-6);
  }
}

TEST_F(MeshFile, WhatIsBrokenIsRefusedByName) {
  EXPECT_THROW(write_mesh(path("m.obj"), hollow_box()), InputError);
  EXPECT_THROW(write_mesh(path("absent/m.ply"), hollow_box()), InputError);
  EXPECT_THROW(read_mesh(path("absent.ply")), InputError);
  EXPECT_THROW(read_mesh(written("a.ply", "")), InputError);
  EXPECT_THROW(read_mesh(written("b.ply", "ply\nformat ascii 1.0\nend_header\n")), InputError);
  EXPECT_THROW(read_mesh(written("c.stl", "hello")), InputError);
  EXPECT_THROW(read_mesh(written("d.stl", "solid x\nfacet\nouter loop\nvertex 0 0 zero\n")),
               InputError);
  const std::string header =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
      "property double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_EQ(read_mesh(written("e.ply", header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")).faces.size(),
            1U);
  EXPECT_THROW(read_mesh(written("f.ply", header + "0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n")), InputError);
  EXPECT_THROW(read_mesh(written("g.ply", header + "0 0 0\n1 0 0\n")), InputError);
  EXPECT_THROW(read_mesh(written("h.ply", header + "0 0 0\n1 0 0\n0 1 0\n4 0 1 2 0\n")),
               InputError);
}

/// The message when the bytes are refused; empty when they are not.
std::string refusal(const std::string& data, const std::string& name) {
  try {
    parse_mesh(data, name);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST_F(MeshFile, CountsThatAreNoneAreRefused) {
  const auto ply = [](const std::string& count) {
    return "ply\nformat ascii 1.0\nelement vertex " + count +
           "\nproperty double x\nproperty double y\nproperty double z\nelement face 0\n"
           "property list uchar int vertex_indices\nend_header\n0 0 0\n";
  };
  EXPECT_EQ(refusal(ply("1"), "m.ply"), "");
  EXPECT_EQ(refusal(ply("99999999999999999999999"), "m.ply"),
            "m.ply: the file ends too early; write it anew");
  EXPECT_EQ(refusal(ply("1e3"), "m.ply"),
            "m.ply: the header does not say how many elements there are; write it anew");
  EXPECT_EQ(refusal(ply("-1"), "m.ply"),
            "m.ply: the header does not say how many elements there are; write it anew");
  EXPECT_EQ(refusal(ply(""), "m.ply"),
            "m.ply: the header does not say how many elements there are; write it anew");
}

TEST_F(MeshFile, NumbersOfOtherKindsAreRefused) {
  const auto ply = [](const std::string& coordinate, const std::string& index) {
    std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 0\n";
    for (const char* axis : {"x", "y", "z"}) header += "property " + coordinate + " " + axis + "\n";
    return header + "element face 0\nproperty list uchar " + index +
           " vertex_indices\nend_header\n";
  };
  EXPECT_EQ(refusal(ply("float32", "uint32"), "m.ply"), "");
  EXPECT_NE(refusal(ply("short", "int"), "m.ply").find("float or double coordinates"),
            std::string::npos);
  EXPECT_NE(refusal(ply("double", "short"), "m.ply").find("32-bit integers"), std::string::npos);
}

TEST_F(MeshFile, AHeaderThatEndsWithTheFileHasNoElements) {
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty double x\n"
      "property double y\nproperty double z\nelement face 0\n"
      "property list uchar int vertex_indices\nend_header";
  EXPECT_EQ(refusal(header, "m.ply"), "m.ply: the file ends too early; write it anew");
  EXPECT_EQ(refusal(header + "\n", "m.ply"), "m.ply: the file ends too early; write it anew");
}

TEST_F(MeshFile, VerticesThatAreNotFiniteAreRefused) {
  for (const double bad : {kNaN, std::numeric_limits<double>::infinity()}) {
    Mesh mesh = hollow_box();
    mesh.vertices_m[3].y() = bad;
    for (const char* name : {"m.ply", "m.stl"}) {
      EXPECT_EQ(refusal(format_mesh(mesh, name), name),
                std::string(name) + ": vertices must be finite");
    }
  }
}

TEST_F(MeshFile, ATruncatedFileIsNeverHalfRead) {
  for (const char* name : {"m.ply", "m.stl"}) {
    write_mesh(path(name), hollow_box());
    std::ifstream in(path(name), std::ios::binary);
    const std::string whole((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    for (std::size_t size = 0; size < whole.size(); size += 37) {
      EXPECT_THROW(read_mesh(written(std::string("cut_") + name, whole.substr(0, size))),
                   InputError)
          << name << " cut at " << size;
    }
  }
}

}  // namespace
}  // namespace cdprcal
