#include "cdprcal/kinematics/cable.hpp"

#include <gtest/gtest.h>

#include "../support/numeric_jacobian.hpp"
#include "../support/random_robot.hpp"

namespace cdprcal {
namespace {

using test::jacobian_matches;
using test::numeric_jacobian;
using test::Rng;
using test::uniform;

struct PulleyCase {
  Pulley pulley;
  Vector3 q;
};

Pulley random_pulley(Rng& rng, double radius) {
  Pulley pulley;
  pulley.radius_m = radius;
  pulley.axes_world = test::random_rotation(rng).toRotationMatrix();
  return pulley;
}

Vector3 in_world(const Pulley& pulley, double radial, double swivel, double height) {
  return pulley.axes_world * Vector3(radial * std::cos(swivel), radial * std::sin(swivel), height);
}

/// Anchors all around pulleys and eyelets, at least 4 cm of free cable from any singularity.
std::vector<PulleyCase> pulley_cases(int count = 300) {
  Rng rng(21);
  std::vector<PulleyCase> cases;
  while (static_cast<int>(cases.size()) < count) {
    const double radius = cases.size() % 3 == 0 ? 0.0 : uniform(rng, 0.005, 0.2);
    const Pulley pulley = random_pulley(rng, radius);
    const Vector3 q =
        in_world(pulley, uniform(rng, 0.04, 1.5), uniform(rng, -kPi, kPi), uniform(rng, -1.5, 1.5));
    const CableState state = cable_state(pulley, q);
    if (state.status != CableStatus::ok || state.free_length_m < 0.04) continue;
    cases.push_back({pulley, q});
  }
  return cases;
}

TEST(Cable, TangencyIsEquation4AsPrinted) {
  int below_half_turn = 0;
  for (const auto& [pulley, q] : pulley_cases()) {
    const CableState s = cable_state(pulley, q);
    const double k = q.dot(pulley.swivel_axis());
    const double u = q.dot(s.radial);
    const double ratio = k / u;
    const double root = std::sqrt(ratio * ratio + 1.0 - 2.0 * pulley.radius_m / u);
    EXPECT_NEAR(s.tangency_rad, 2.0 * std::atan(ratio + root), 1e-12);
    below_half_turn += s.tangency_rad < 0.0 ? 1 : 0;
  }
  EXPECT_GT(below_half_turn, 3);  // cables wrapped by more than half a turn are among the cases
}

TEST(Cable, VectorsAreThoseOfEquations1To3) {
  for (const auto& [pulley, q] : pulley_cases()) {
    const CableState s = cable_state(pulley, q);
    const Vector3 i = pulley.x_axis(), j = pulley.y_axis(), k = pulley.swivel_axis();
    EXPECT_NEAR(s.swivel_rad, std::atan2(j.dot(q), i.dot(q)), 1e-15);
    EXPECT_LE((s.radial - std::cos(s.swivel_rad) * i - std::sin(s.swivel_rad) * j).norm(), 1e-14);
    EXPECT_LE((s.groove_normal - k.cross(s.radial)).norm(), 1e-14);
    EXPECT_LE(
        (s.contact - std::cos(s.tangency_rad) * s.radial - std::sin(s.tangency_rad) * k).norm(),
        1e-14);
    EXPECT_LE((s.direction - s.groove_normal.cross(s.contact)).norm(), 1e-14);
    EXPECT_NEAR(s.radial_distance_m, s.radial.dot(q), 1e-14);
    EXPECT_NEAR(s.groove_normal.dot(q), 0.0, 1e-14);
    // The cable leaves the groove in B, tangentially, and ends in A.
    const Vector3 rho = q - pulley.radius_m * (s.radial + s.contact);
    EXPECT_LE((rho - s.free_length_m * s.direction).norm(), 1e-14);
    EXPECT_NEAR(s.contact.dot(rho), 0.0, 1e-14);
    EXPECT_NEAR(s.length_m, rho.norm() + pulley.radius_m * (kPi - s.tangency_rad), 1e-14);
  }
}

TEST(Cable, LengthIsStationaryInThePointOfContact) {
  // A taut cable lies where wrapping a little more or less changes its length only to second order.
  for (const auto& [pulley, q] : pulley_cases()) {
    const CableState s = cable_state(pulley, q);
    const auto length = [&](const Eigen::VectorXd& change) {
      const double angle = s.tangency_rad + change[0];
      const Vector3 n = std::cos(angle) * s.radial + std::sin(angle) * pulley.swivel_axis();
      return (q - pulley.radius_m * (s.radial + n)).norm() + pulley.radius_m * (kPi - angle);
    };
    EXPECT_TRUE(jacobian_matches(Eigen::MatrixXd::Zero(1, 1),
                                 numeric_jacobian(length, Eigen::VectorXd::Zero(1), 1e-3), 1e-9));
  }
}

TEST(Cable, DerivativesByThePlatformAnchor) {
  for (const auto& [pulley, q] : pulley_cases()) {
    const CableState here = cable_state(pulley, q);
    const CableDerivatives d = cable_derivatives(pulley, here);
    const Pulley& p = pulley;
    const auto by_q = [&](const auto& output) {
      return numeric_jacobian([&](const Eigen::VectorXd& x) { return output(cable_state(p, x)); },
                              q, 1e-3);
    };
    EXPECT_TRUE(jacobian_matches(d.length_by_q.transpose(),
                                 by_q([](const CableState& s) { return s.length_m; })));
    EXPECT_TRUE(jacobian_matches(d.swivel_by_q.transpose(), by_q([&](const CableState& s) {
                                   return wrap_angle(s.swivel_rad - here.swivel_rad);
                                 })));
    EXPECT_TRUE(jacobian_matches(d.tangency_by_q.transpose(),
                                 by_q([](const CableState& s) { return s.tangency_rad; })));
    EXPECT_TRUE(
        jacobian_matches(d.direction_by_q, by_q([](const CableState& s) { return s.direction; })));
    EXPECT_EQ(d.direction_by_q, direction_by_q(here));
    EXPECT_EQ(d.swivel_by_q, swivel_by_q(here));
  }
}

TEST(Cable, DerivativesByTheRadius) {
  for (const auto& [pulley, q] : pulley_cases()) {
    const CableDerivatives d = cable_derivatives(pulley, cable_state(pulley, q));
    const auto by_radius = [&](const auto& output) {
      return numeric_jacobian(
          [&](const Eigen::VectorXd& radius) {
            Pulley other = pulley;
            other.radius_m = radius[0];  // the formulas go on below 0, so radius 0 has both sides
            return output(cable_state(other, q));
          },
          Eigen::VectorXd::Constant(1, pulley.radius_m), 1e-3);
    };
    EXPECT_TRUE(jacobian_matches(Eigen::MatrixXd::Constant(1, 1, d.length_by_radius),
                                 by_radius([](const CableState& s) { return s.length_m; })));
    EXPECT_TRUE(jacobian_matches(Eigen::MatrixXd::Constant(1, 1, d.tangency_by_radius),
                                 by_radius([](const CableState& s) { return s.tangency_rad; })));
    EXPECT_TRUE(jacobian_matches(d.direction_by_radius,
                                 by_radius([](const CableState& s) { return s.direction; })));
    EXPECT_TRUE(jacobian_matches(Eigen::MatrixXd::Zero(1, 1),
                                 by_radius([](const CableState& s) { return s.swivel_rad; })));
  }
}

TEST(Cable, DirectionDerivativeIsTheTOfEquationA5WhileTheWrapIsUnderHalfATurn) {
  for (const auto& [pulley, q] : pulley_cases()) {
    const CableState s = cable_state(pulley, q);
    const Matrix3 t = direction_by_q(s);
    EXPECT_LE((t - t.transpose()).norm(), 1e-13 * t.norm());
    EXPECT_LE((t * s.direction).norm(), 1e-13 * t.norm());  // pulling along the cable turns nothing
    const Vector3 rho = q - pulley.radius_m * (s.radial + s.contact);
    const Matrix3 printed = s.radial.cross(s.contact).norm() / s.radial.dot(q) * s.groove_normal *
                                s.groove_normal.transpose() +
                            s.contact * s.contact.transpose() / rho.norm();
    // ‖u × n‖ is |sin ψ|: the printed formula loses the sign of sin ψ beyond half a turn.
    const bool agrees = (t - printed).norm() <= 1e-12 * t.norm();
    EXPECT_EQ(agrees, s.tangency_rad > 0.0) << s.tangency_rad;
  }
}

TEST(Cable, AnEyeletIsAPulleyOfVanishingRadius) {
  for (auto [pulley, q] : pulley_cases()) {
    pulley.radius_m = 0.0;
    const CableState eyelet = cable_state(pulley, q);
    const CableDerivatives slope = cable_derivatives(pulley, eyelet);
    EXPECT_NEAR(eyelet.length_m, q.norm(), 1e-14);
    EXPECT_LE((eyelet.direction - q.normalized()).norm(), 1e-14);
    for (const double radius : {1e-4, 1e-6, 1e-8}) {
      pulley.radius_m = radius;
      const CableState s = cable_state(pulley, q);
      // First order in the radius, with the slope at 0; what is left is of second order.
      const double curvature = 10.0 / (eyelet.radial_distance_m * eyelet.radial_distance_m);
      const double left = curvature * radius * radius + 1e-14;
      EXPECT_NEAR(s.length_m, eyelet.length_m + radius * slope.length_by_radius, left);
      EXPECT_LE((s.direction - eyelet.direction - radius * slope.direction_by_radius).norm(),
                left / eyelet.radial_distance_m + 1e-14);
      EXPECT_EQ(s.swivel_rad, eyelet.swivel_rad);
    }
  }
}

TEST(Cable, WithoutATangentThereIsAStatusAndNoNumber) {
  Rng rng(22);
  const Pulley pulley = random_pulley(rng, 0.05);
  const auto expect_status = [&](const Pulley& p, const Vector3& q, CableStatus status) {
    const CableState s = cable_state(p, q);
    EXPECT_EQ(s.status, status) << to_string(s.status);
    EXPECT_TRUE(std::isnan(s.length_m) && std::isnan(s.swivel_rad) && s.direction.hasNaN());
  };
  expect_status(pulley, in_world(pulley, 0.05, 0.7, 0.0), CableStatus::anchor_inside_pulley);
  expect_status(pulley, in_world(pulley, 0.05, 0.7, 0.0499), CableStatus::anchor_inside_pulley);
  Pulley upright;
  upright.radius_m = 0.05;
  expect_status(upright, {0.0, 0.0, -1.0}, CableStatus::anchor_on_swivel_axis);
  expect_status(upright, {0.0, 0.0, 0.0}, CableStatus::anchor_on_swivel_axis);
  expect_status(upright, Vector3::Constant(kNaN), CableStatus::anchor_on_swivel_axis);
  EXPECT_EQ(cable_state(pulley, in_world(pulley, 0.05, 0.7, 0.0501)).status, CableStatus::ok);
}

TEST(Cable, AnAnchorOnTheRimHasNoFreeCableAndIsRefused) {
  // A free length of 0 has no direction derivative. Powers of two, so that it is 0 exactly.
  Pulley pulley;
  pulley.radius_m = 0.0625;
  const CableState rim = cable_state(pulley, {0.125, 0.0, 0.0});
  EXPECT_EQ(rim.status, CableStatus::anchor_inside_pulley);
  EXPECT_TRUE(std::isnan(rim.length_m));
  const CableState above = cable_state(pulley, {0.125, 0.0, 1e-6});
  ASSERT_EQ(above.status, CableStatus::ok);
  EXPECT_DOUBLE_EQ(above.free_length_m, 1e-6);
  EXPECT_TRUE(direction_by_q(above).allFinite());
}

}  // namespace
}  // namespace cdprcal
