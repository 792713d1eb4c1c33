// The measurement plan: which poses, in which order, at which tensions and how fast
// (paper §3.2.1, §3.2.2), checked before anything moves.
#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cdprcal/planning/order.hpp"
#include "cdprcal/planning/pose_grid.hpp"
#include "cdprcal/planning/timing.hpp"
#include "cdprcal/statics/natural_frequencies.hpp"

namespace cdprcal {

/// One stop of a plan: a transition to its tensions, then a wait.
struct PlannedPose {
  bool measured = true;  ///< false: passed through only, because no direct way is safe
  Pose pose;
  CableVector tension_N;
  double transition_s = 0.0;  ///< of the fifth-degree transition from the stop before
  double dwell_s = 0.0;       ///< until the platform rests and, when measured, has been measured
  ModeVector natural_frequencies_hz;  ///< of the slowest 6 − n motions with locked cables, rising
  ModeVector constant_tension_frequencies_hz;  ///< under force control: 6, rising; from six cables
                                               ///< on both are empty: lengths hold the platform
};

/// What `acquire` runs. Everything in SI units, the world frame, poses of P. Tensions are
/// set-points as the load cells read them: what the cables carry, unless the robot file lists
/// effects of the load cells.
struct Plan {
  std::string robot_name;
  CableVector start_tension_N;     ///< τ0: the set-point of the home pose
  Pose start_pose;                 ///< where the run begins; ζ0, if the model is right
  double start_dwell_s = 0.0;      ///< at τ0 before the run, for any swing to die out
  std::vector<PlannedPose> poses;  ///< in visiting order
  double duration_s = 0.0;         ///< the start's dwell and all transitions and dwells
  /// Of the initial pose after this plan, `--method static`, full formulation: position [m],
  /// world-frame rotation vector [rad]; NaN when it would not be observable.
  Vector6 predicted_standard_deviation = Vector6::Constant(kNaN);

  [[nodiscard]] int measured_count() const;
};

struct PlanProgress {
  const char* stage = "";  ///< what is being done, for people
  double share = 0.0;      ///< of the stage: 0 … 1
};

struct PlanOptions {
  std::optional<Box> box;            ///< of the grid; default: propose_measurement_box
  std::array<int, 3> grid{2, 2, 2};  ///< n_x, n_y, n_z; one across a planar platform's plane
  /// Above 0: this many poses chosen by observability from the set-points that can be reached,
  /// inside `box` if that is given, else from the whole static workspace.
  int optimal = 0;
  std::vector<Vector3> positions_m;  ///< instead of a grid, when not empty
  std::optional<Vector3> home_m;     ///< position of the start; default: middle of the box
  VisitingOrder order = VisitingOrder::least_time;
  int visits = 2;          ///< of each pose, in random order
  std::uint64_t seed = 1;  ///< of the random order
  SetPointOptions set_points;
  std::optional<Box> bounds;  ///< that the platform may not leave; see PathOptions
  TimingOptions timing;
  int threads = 0;  ///< 0: one a core
  /// Called from the calling thread now and then; false stops.
  std::function<bool(const PlanProgress&)> progress;
};

enum class PlanStatus {
  planned,
  infeasible,  ///< a pose is no set-point or cannot be reached; the plan is empty
  stopped      ///< `progress` said so; the plan is empty
};

const char* to_string(PlanStatus status);

/// How many poses chosen by observability the grid is worth.
struct GridComparison {
  int grid_poses = 0;
  Vector6 grid_standard_deviation = Vector6::Constant(kNaN);
  std::vector<Vector6> optimal_standard_deviation;  ///< of 1, 2, … poses
  /// The fewest that are no worse than the grid both in position and in rotation (root sum of
  /// squares over the axes), if `optimal` are enough.
  std::optional<int> poses_needed;
};

struct PlanResult {
  PlanStatus status = PlanStatus::infeasible;
  std::string reason;  ///< one sentence for people; empty when planned
  Plan plan;
  Box box;                                   ///< of the grid
  std::string box_origin;                    ///< where it comes from
  bool order_is_optimal = false;             ///< least time, proved
  std::optional<ApproachCoverage> approach;  ///< of a random order
  std::optional<GridComparison> comparison;  ///< with `optimal`, when the grid can be measured
  int candidates = 0;                        ///< that `optimal` chose from
};

/// Plans, with the effects that the robot lists for every run (see KnownEffects): their geometry
/// and inertia throughout; readings and poses of the finished plan are those of the robot with all
/// of them, so with an external force a stop is where it rests, a little off the grid. A pose that
/// cannot be measured or reached is a status, not an exception. Throws InputError for options that
/// make no sense and for robots without an inverse problem (n < 3).
PlanResult make_plan(const Robot& robot, const PlanOptions& options = {});

/// Follows a plan's transitions with a robot's model, as make_plan did: a plan edited by hand, or
/// made for other parameters, is caught before anything moves. Empty when every set-point is an
/// equilibrium and every path clear; otherwise what is wrong with which stop. Throws InputError for
/// a plan that does not fit the robot (cable_count, tension limits).
std::string verify_plan(const Robot& given, const Plan& plan,
                        const std::optional<Box>& bounds = std::nullopt);

}  // namespace cdprcal
