// Meshes: checks, volume, inclusion, sections, files.
#include "cdprcal/workspace/mesh.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

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

/// One triangle, of which single precision cannot hold every number.
Mesh triangle() { return {{{0, 0, 0.25}, {1.0 / 3.0, 0, 0.25}, {0, 2, 0.25}}, {{0, 1, 2}}}; }

/// A value at a place of a file's bytes.
template <class T>
T at(const std::string& bytes, std::size_t place) {
  T value{};
  std::memcpy(&value, bytes.substr(place, sizeof(T)).data(), sizeof(T));
  return value;
}

TEST(MeshFile, PlyHoldsEveryDigit) {
  const std::string head =
      "element vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::string said = " 1.0\ncomment static workspace boundary, metres\n";
  EXPECT_EQ(format_mesh(triangle(), "m.ply", MeshEncoding::ascii),
            "ply\nformat ascii" + said + head +
                "0 0 0.25\n0.33333333333333331 0 0.25\n0 2 0.25\n3 0 1 2\n");
  const std::string begin = "ply\nformat binary_little_endian" + said + head;
  const std::string binary = format_mesh(triangle(), "m.ply", MeshEncoding::binary);
  ASSERT_EQ(binary.size(), begin.size() + 9 * sizeof(double) + 1 + 3 * sizeof(std::int32_t));
  EXPECT_EQ(binary.substr(0, begin.size()), begin);
  const std::array<double, 9> numbers = {0, 0, 0.25, 1.0 / 3.0, 0, 0.25, 0, 2, 0.25};
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    EXPECT_EQ(at<double>(binary, begin.size() + k * sizeof(double)), numbers[k]) << k;
  }
  const std::size_t face = begin.size() + 9 * sizeof(double);
  EXPECT_EQ(binary[face], 3);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(at<std::int32_t>(binary, face + 1 + sizeof(std::int32_t) * k), k);
  }
}

TEST(MeshFile, StlHoldsNormalsAndCornersInSinglePrecision) {
  EXPECT_EQ(format_mesh(triangle(), "m.STL", MeshEncoding::ascii),
            "solid workspace\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0.25\n"
            "vertex 0.333333333 0 0.25\nvertex 0 2 0.25\nendloop\nendfacet\nendsolid workspace\n");
  const std::string binary = format_mesh(triangle(), "m.STL", MeshEncoding::binary);
  ASSERT_EQ(binary.size(), 80U + 4U + 50U);
  EXPECT_EQ(at<std::uint32_t>(binary, 80), 1U);
  const std::array<float, 12> numbers = {0, 0, 1, 0, 0, 0.25F, 1.0F / 3.0F, 0, 0.25F, 0, 2, 0.25F};
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    EXPECT_EQ(at<float>(binary, 84 + k * sizeof(float)), numbers[k]) << k;
  }
  EXPECT_EQ(at<std::uint16_t>(binary, 132), 0U);
}

TEST(MeshFile, AFaceWithoutAreaHasNoNormal) {
  Mesh flat = triangle();
  flat.vertices_m[2] = flat.vertices_m[1];
  EXPECT_NE(format_mesh(flat, "m.stl", MeshEncoding::ascii).find("facet normal 0 0 0\n"),
            std::string::npos);
}

TEST(MeshFile, WhatCannotBeWrittenIsRefusedByName) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "cdprcal_mesh_file";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "m.ply").string();
  write_mesh(path, triangle());
  std::ifstream in(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  EXPECT_EQ(bytes, format_mesh(triangle(), path, MeshEncoding::binary));
  EXPECT_THROW(write_mesh((folder / "m.obj").string(), triangle()), InputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "m.obj"));
  EXPECT_THROW(write_mesh((folder / "absent" / "m.ply").string(), triangle()), InputError);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace cdprcal
