// In which order to visit the measurement poses.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace cdprcal {

enum class VisitingOrder {
  least_time,  ///< each pose once, the least sum of transition and dwell times
  random       ///< each pose several times, shuffled: drifts and creep then look like no pose
};

/// "least-time", "random"; throws InputError naming the choices.
VisitingOrder parse_visiting_order(const std::string& name);
const char* to_string(VisitingOrder order);

struct Tour {
  std::vector<int> order;  ///< poses from 0; the start is not listed
  double time_s = 0.0;
  bool optimal = false;  ///< proved; otherwise no exchange of two stretches and no move of one
                         ///< makes it shorter
};

/// Shortest tour that starts at the start, visits every pose once and ends anywhere (an open
/// travelling-salesman tour). time_s: (k+1)×(k+1), entry (i, j) from place i to place j, place 0
/// the start, place p + 1 pose p; it need not be symmetric; infinite where there is no way. Exact
/// (Held & Karp 1962) up to `kMostExact` poses; beyond, nearest neighbour from several first poses,
/// each improved by 2-opt and or-opt; the same input gives the same tour. time_s of the tour is
/// infinite when no way was found. Throws InputError for a matrix that is not square or has NaN.
Tour least_time_tour(const Eigen::MatrixXd& time_s);
inline constexpr int kMostExact = 12;

/// Rounds of random order, `visits` of them, each of every pose once; no pose twice in a row.
/// Friction and hysteresis depend on the direction in which a cable arrives, so among random orders
/// one is sought in which as many cables as possible reach each pose both ways, paying out and
/// reeling in. length_m: (k+1)×n cable lengths at the start and the poses. The same seed gives the
/// same order everywhere. Throws InputError for visits below 1, or several visits of a single pose.
std::vector<int> random_order(const Eigen::MatrixXd& length_m, int visits, std::uint64_t seed);

/// How well an order tells the two directions apart.
struct ApproachCoverage {
  int both = 0;      ///< pairs (pose, cable) approached paying out and reeling in
  int possible = 0;  ///< pairs for which poses with longer and with shorter cable exist
};
ApproachCoverage approach_coverage(const Eigen::MatrixXd& length_m, const std::vector<int>& order);

}  // namespace cdprcal
