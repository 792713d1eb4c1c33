// One robot over time: which of the numbers that its model lacks moved from log to log.
#pragma once

#include "cdprcal/diagnosis/diagnose.hpp"

namespace cdprcal {

/// One number of an effect, as each log by itself has it; in reported units.
struct ComparedNumber {
  std::shared_ptr<const Effect> effect;
  int parameter = 0;                           ///< of effect->info().parameters
  int entry = 0;                               ///< of the parameter's numbers: cable, axis
  Eigen::VectorXd values, standard_deviation;  ///< one a log; NaN where its fit did not settle
  double chi_square = 0.0;                     ///< of the logs against their weighted mean
  double p_value = 1.0;  ///< that chance alone does so to any of all numbers (Bonferroni)
  bool moved = false;    ///< p_value below what is asked for
  /// Where one step explains most: between the log before this one and it, from 1; by how much.
  int from_log = 0;
  double step = kNaN, step_deviation = kNaN;
};

struct Comparison {
  std::vector<std::string> logs;      ///< run_names
  std::vector<DiscreteFault> faults;  ///< of any log, set right in all
  std::vector<ComparedNumber> numbers;
  std::vector<Pose> initial_pose;        ///< one a log, with the effects
  std::vector<Matrix6> covariance;       ///< of it
  std::vector<std::string> not_settled;  ///< logs that the effects could not be fitted to
  bool complete = true;                  ///< false: progress stopped it
};

/// Finds the effects of all logs together and of each alone, then fits all of them to each log
/// alone. Logs in the order of time. Throws InputError for fewer than two logs and for one that
/// does not fit the robot.
Comparison compare(const Robot& robot, const std::vector<Log>& logs,
                   const DiagnoseOptions& options = {});

}  // namespace cdprcal
