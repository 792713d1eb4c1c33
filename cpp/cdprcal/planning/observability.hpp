// What measurement poses will say about the initial pose, before anything moves, and which say
// most.
//
// The information that a pose adds to the common unknowns (ζ0 and the errors of the reference
// readings) does not depend on the other poses, so it is worked out once for each candidate and
// sets of poses are compared by adding 6 × 6 to 23 × 23 matrices.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "cdprcal/estimation/problem.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/planning/set_point.hpp"

namespace cdprcal {

/// The problem that `cdprcal calibrate --method static` will pose for these set-points, with exact
/// readings: full formulation (six-equation wrench statics, all that pose 0 knows). The first
/// measurement is the start, whose pose is ζ0.
CalibrationProblem predicted_problem(const Robot& robot, const SetPoint& start,
                                     const std::vector<SetPoint>& set_points);

/// Covariance of ζ0 (position [m], world-frame rotation vector [rad]) that these set-points will
/// give, for the robot's σ; nothing when ζ0 stays unobservable.
std::optional<Matrix6> predicted_covariance(const Robot& robot, const SetPoint& start,
                                            const std::vector<SetPoint>& set_points);

/// Information on ζ0 and the reference errors, a set-point at a time.
class Observability {
 public:
  Observability(const Robot& robot, const SetPoint& start);

  /// What the start knows by itself (priors of the reference errors, absolute roll and pitch,
  /// balance), and what one more set-point adds: symmetric, ζ0 first, then the errors of lengths,
  /// swivels and yaw.
  [[nodiscard]] const Eigen::MatrixXd& of_start() const { return start_information_; }
  [[nodiscard]] Eigen::MatrixXd added_by(const SetPoint& set_point) const;

  /// Information on ζ0 alone in a sum of the above (Schur complement).
  [[nodiscard]] static Matrix6 on_initial_pose(const Eigen::MatrixXd& information);

 private:
  /// Rows of the two-pose problem: those of the start alone, and those of the other pose with that
  /// pose eliminated.
  struct Split {
    Eigen::MatrixXd start;
    Eigen::MatrixXd added;
  };
  [[nodiscard]] Split linearised(const SetPoint& set_point) const;

  Robot robot_;
  SetPoint start_;
  Eigen::MatrixXd start_information_;
};

/// Candidates chosen, in the order of their gain.
struct Selection {
  std::vector<int> chosen;
  std::optional<Matrix6> covariance;  ///< of ζ0
  bool stopped = false;               ///< `proceed` said so; `chosen` is short then
};

/// The `count` candidates that make the determinant of the information on ζ0 largest (D-optimal):
/// greedily, then by exchanging one at a time until no exchange helps. Each candidate at most once:
/// a pose measured twice averages noise, but repeats every error of the model. The same input gives
/// the same choice. `information` is Observability::added_by of each candidate. Throws InputError
/// when there are fewer candidates than `count`. `motion`: motion_basis of the robot.
Selection select_d_optimal(const Eigen::MatrixXd& start_information,
                           const std::vector<Eigen::MatrixXd>& information, int count,
                           const std::function<bool()>& proceed = {},
                           const TwistBasis& motion = Matrix6::Identity());

}  // namespace cdprcal
