#include "cdprcal/frame/determined.hpp"

#include <algorithm>

#include "cdprcal/decompositions.hpp"
#include "cdprcal/effects/moved_pulleys.hpp"
#include "cdprcal/frame/gauge.hpp"
#include "cdprcal/kinematics/obstruction.hpp"
#include "cdprcal/text.hpp"

namespace cdprcal::detail {
namespace {

/// Blocks of neighbouring poses whose scores are compared; fewer poses than three a block: fewer.
constexpr Eigen::Index kBlocks = 10;
/// A rigid motion is shown by the readings where they make it known better than half of what the
/// file's positions alone do.
constexpr double kShown = 0.25;  // of the variance
/// Components of a direction that are named: at least this share of the largest.
constexpr double kNamed = 0.35;
constexpr int kFurtherPoses = 3;
constexpr int kMostWeak = 3;

/// Leaves out of the covariance of the anchors the rigid motions that only the prior fixes.
void leave_out_motions(const FrameProblem& problem, const Robot& robot, Knowledge& known) {
  const FrameUnknowns& u = problem.unknowns;
  known.without_motions = Eigen::MatrixXd::Identity(u.size, u.size);
  const int size = u.axis_count * u.cables;
  const Eigen::VectorXd weight = u.precision.head(size);
  // Held by a convention, or by a tracker.
  if (u.by_convention() || !fixes_place(u, robot)) return;
  const Eigen::MatrixXd rigid = rigid_motions(u, robot);
  const Eigen::MatrixXd gram = rigid.transpose() * weight.asDiagonal() * rigid;
  const Eigen::MatrixXd prior = inverse(gram);
  const Eigen::MatrixXd coefficient = prior * rigid.transpose() * weight.asDiagonal();
  const Eigen::MatrixXd posterior =
      coefficient * known.covariance.topLeftCorner(size, size) * coefficient.transpose();
  const Eigen::MatrixXd symmetric = 0.5 * (posterior + posterior.transpose());
  const SymmetricEigen<Eigen::MatrixXd> eigen = symmetric_eigen(symmetric, prior);
  known.unshown = Eigen::MatrixXd::Zero(rigid.cols(), size);
  for (Eigen::Index k = 0; k < eigen.eigenvalues().size(); ++k) {
    if (eigen.eigenvalues()[k] < kShown) continue;
    ++known.free_motions;
    // vᵀ prior v = 1: the coefficient along v is vᵀ x, the motion of one σ prior · v
    const Eigen::VectorXd v = eigen.eigenvectors().col(k);
    known.unshown += prior * v * v.transpose() * coefficient;
  }
  Eigen::MatrixXd& off = known.without_motions;
  off.topLeftCorner(size, size) -= rigid * known.unshown;
  known.covariance = off * known.covariance * off.transpose();
}

/// How much more the scores of blocks scatter than independent rows would: a variance.
double scatter(const FrameInformation& information, const Eigen::MatrixXd& inverse) {
  const Eigen::Index poses = information.scores.cols();
  const Eigen::Index blocks = std::min(kBlocks, poses / 3);
  const double parameters = (inverse * information.normal).trace();
  if (blocks < 3 || !(parameters > 0.5)) return 1.0;
  Eigen::VectorXd sums = Eigen::VectorXd::Zero(blocks);
  double total = 0.0;
  for (Eigen::Index b = 0; b < blocks; ++b) {
    const Eigen::Index begin = b * poses / blocks, end = (b + 1) * poses / blocks;
    const Eigen::VectorXd score = information.scores.middleCols(begin, end - begin).rowwise().sum();
    total += score.dot(inverse * score);
  }
  const double count = static_cast<double>(blocks);
  return std::max(1.0, total * count / (count - 1.0) / parameters);
}

std::string millimetres(double metres) {
  const double mm = 1e3 * metres;
  if (!(mm < 1e4)) return "more than 10 m";
  return printed(mm < 10.0 ? "%.1f mm" : "%.0f mm", mm);
}

std::string components(const Vector3& v) {
  return "(" + printed("%.2f", v[0]) + ", " + printed("%.2f", v[1]) + ", " + printed("%.2f", v[2]) +
         ")";
}

/// "x" … for a world axis, else its components.
std::string direction_name(const Vector3& axis) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(axis[i]) > 0.999) return std::string(axis[i] < 0.0 ? "-" : "") + "xyz"[i];
  }
  return components(axis);
}

/// What a value is, for people; "" for those that are not about the frame and its lengths.
std::string value_name(const FrameUnknowns& u, int column) {
  if (column < u.axis_count * u.cables) {
    return "pulley " + std::to_string(column / u.axis_count + 1) + " along " +
           direction_name(u.axes.col(column % u.axis_count));
  }
  const int offset = column - u.direct_offsets;
  if (u.direct_offsets < 0 || offset < 0 || offset >= u.direct_offset_count) return "";
  if (u.direct_offset_count == 1) return "the common offset of the lengths";
  return "the offset of length " + std::to_string(offset + 1);
}

/// Values in metres: anchors, and offsets of whole lengths.
Eigen::VectorXi metric_columns(const FrameUnknowns& u) {
  const int pulleys = u.axis_count * u.cables;
  Eigen::VectorXi out = Eigen::VectorXi::LinSpaced(pulleys, 0, pulleys - 1);
  out.conservativeResize(pulleys + u.direct_offset_count);
  for (int i = 0; i < u.direct_offset_count; ++i) out[pulleys + i] = u.direct_offsets + i;
  return out;
}

SymmetricEigen<Eigen::MatrixXd> metric_eigen(const FrameUnknowns& u, const Knowledge& known) {
  const Eigen::VectorXi columns = metric_columns(u);
  return SymmetricEigen<Eigen::MatrixXd>(known.covariance(columns, columns));
}

std::string image_in_words(MirrorTold told) {
  switch (told) {
    case MirrorTold::by_file:
      return "is the file's";
    case MirrorTold::by_weight:
      return "is the one in which the cables can hold the platform, clear of floor and obstacles";
    default:
      return "may be either: neither the file's positions nor the weight tell them apart";
  }
}

/// What hold_place made of pulleys.
std::string held_in_words(const FrameUnknowns& u) {
  constexpr const char* kHeld[] = {"is where the robot file has it",
                                   "in the direction that the file has it in",
                                   "in the plane that the file has it in"};
  std::string text;
  for (std::size_t i = 0; i < u.reference.size(); ++i) {
    const int cable = u.reference[i];
    bool held = false, told = true;
    for (int axis = 0; axis < u.axis_count; ++axis) {
      held = held || u.held[static_cast<std::size_t>(u.anchor(cable, axis))];
      told = told && u.precision[u.anchor(cable, axis)] > 0.0;
    }
    if (!held && !told) continue;
    text += (text.empty() ? "pulley " : ", pulley ") + std::to_string(cable + 1) + " ";
    text += held ? kHeld[std::min<std::size_t>(i, 2)] : "is as well known as the file says";
  }
  return text;
}

/// Whether belts can hold a point of a plane: they pull to all sides.
bool held_from_all_sides(const Robot& robot, const Matrix3& axes, const Vector3& point) {
  std::vector<double> angles;
  for (const Cable& cable : robot.cables) {
    const Vector3 belt = cable.pulley.position_m - point;
    angles.push_back(std::atan2(belt.dot(axes.col(1)), belt.dot(axes.col(0))));
  }
  std::sort(angles.begin(), angles.end());
  double gap = 2.0 * kPi - (angles.back() - angles.front());
  for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
  return gap < kPi;
}

/// Places for a platform: a grid over the pulleys' box and below it, with turns of those that turn.
std::vector<Pose> candidates(const FrameProblem& problem, const FrameState& state) {
  const Robot robot = moved(problem, state.values);
  Box within = pulley_box(robot), seen = Box::empty();
  for (const Pose& pose : state.poses) seen.include(pose.position_m);
  within.include(seen.lower_m);
  within.include(seen.upper_m);
  if (!row_of(robot.platform.motion).is_planar())
    within.upper_m.z() = seen.upper_m.z();  // it hangs
  const int steps = row_of(robot.platform.motion).is_planar() ? 11 : 5;
  std::vector<Pose> out;
  const auto add = [&](const Vector3& share, const Vector3& turn) {
    Pose pose;
    pose.position_m = within.lower_m + share.cwiseProduct(within.extent_m());
    pose.rotation = exp_so3(turn);
    pose = on_motion(robot, pose);
    const bool planar = row_of(robot.platform.motion).is_planar();
    if (planar && !held_from_all_sides(robot, problem.unknowns.axes, pose.position_m)) return;
    if (!is_clear(robot, pose, platform_state(robot, pose))) return;
    out.push_back(pose);
  };
  const auto count = [&](int axis) { return within.extent_m()[axis] > 1e-6 ? steps : 1; };
  for (int i = 0; i < count(0); ++i) {
    for (int j = 0; j < count(1); ++j) {
      for (int k = 0; k < count(2); ++k) {
        // Not on the border itself: there stand the pulleys.
        const Vector3 share = (Vector3(i, j, k).array() + 0.5) / steps;
        add(share, Vector3::Zero());
        if (robot.platform.motion == Motion::r3t3) add(share, 0.2 * Vector3::Ones());
      }
    }
  }
  return out;
}

/// What poses would tell at which all kinds of readings of the first one are read.
std::vector<Eigen::MatrixXd> told_by(const FrameProblem& problem, const FrameState& state,
                                     const std::vector<Pose>& places) {
  FrameProblem one = problem;
  one.poses.resize(1);
  std::vector<Eigen::MatrixXd> out;
  for (const Pose& place : places) {
    const FrameInformation there = information(one, {state.values, {place}});
    out.push_back(there.valid ? there.normal
                              : Eigen::MatrixXd::Zero(state.values.size(), state.values.size()));
  }
  return out;
}

}  // namespace

Knowledge knowledge(const FrameProblem& problem, const FrameState& state,
                    const FrameInformation& information) {
  const FrameUnknowns& u = problem.unknowns;
  Knowledge out;
  if (!information.valid) return out;
  out.precision = information.normal;
  out.precision.diagonal() += u.precision;
  Eigen::VectorXi free(std::count(u.held.begin(), u.held.end(), false));
  for (int i = 0, next = 0; i < u.size; ++i) {
    if (!u.held[static_cast<std::size_t>(i)]) free[next++] = i;
  }
  // Scaled to a unit diagonal, so that what is singular does not depend on units. What nothing
  // tells at all stays finite when its variance is multiplied.
  const Eigen::MatrixXd block = out.precision(free, free);
  const Eigen::VectorXd scale = block.diagonal().cwiseSqrt().cwiseMax(1e-60).cwiseInverse();
  const SymmetricEigen<Eigen::MatrixXd> eigen(scale.asDiagonal() * block * scale.asDiagonal());
  const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(1e-15);
  Eigen::MatrixXd inverse = scale.asDiagonal() * eigen.eigenvectors() *
                            values.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() *
                            scale.asDiagonal();
  out.covariance = Eigen::MatrixXd::Zero(u.size, u.size);
  out.covariance(free, free) = inverse;
  out.parameters = (out.covariance * information.normal).trace();
  out.whole = out.covariance;
  const double variance = scatter(information, out.covariance);
  out.lack_of_fit = std::sqrt(variance);
  leave_out_motions(problem, moved(problem, state.values), out);
  out.covariance *= variance;
  out.valid = true;
  return out;
}

void hold_unshown(const FrameProblem& problem, const Knowledge& known, FrameState& state) {
  constexpr int kTimes = 4;  // a turn of a few degrees is not small at once
  const FrameUnknowns& u = problem.unknowns;
  if (known.free_motions == 0) return;
  for (int k = 0; k < kTimes; ++k) {
    const Robot robot = moved(problem, state.values);
    const Eigen::VectorXd motion = -known.unshown * state.values.head(known.unshown.cols());
    const Vector3 middle = middle_of_pulleys(robot);
    Vector3 shift = Vector3::Zero(), turn = Vector3::Zero();
    for (int axis = 0; axis < u.axis_count; ++axis) shift += motion[axis] * u.axes.col(axis);
    const auto turns = motion.size() - u.axis_count;
    for (Eigen::Index about = 0; about < turns; ++about) {
      turn += motion[u.axis_count + about] * u.axes.col(turns == 1 ? 2 : about);
    }
    const Eigen::Quaterniond rotation = exp_so3(turn);
    const auto there = [&](const Vector3& at) -> Vector3 {
      return middle + shift + rotation * (at - middle);
    };
    for (int i = 0; i < u.cables; ++i) {
      const Vector3& from = robot.cables[static_cast<std::size_t>(i)].pulley.position_m;
      state.values.segment(u.anchor(i, 0), u.axis_count) +=
          u.axes.leftCols(u.axis_count).transpose() * (there(from) - from);
    }
    for (Pose& pose : state.poses) {
      pose.position_m = there(pose.position_m);
      pose.rotation = rotation * pose.rotation;
    }
  }
}

std::vector<std::string> weak_directions(const FrameProblem& problem, const Knowledge& known,
                                         double enough_m) {
  const FrameUnknowns& u = problem.unknowns;
  const Eigen::VectorXi columns = metric_columns(u);
  const auto eigen = metric_eigen(u, known);
  std::vector<std::string> out;
  for (Eigen::Index k = eigen.eigenvalues().size() - 1; k >= 0; --k) {
    const double sigma = std::sqrt(std::max(0.0, eigen.eigenvalues()[k]));
    if (!(sigma > enough_m) || static_cast<int>(out.size()) == kMostWeak) break;
    const Eigen::VectorXd direction = eigen.eigenvectors().col(k);
    const double most = direction.cwiseAbs().maxCoeff();
    Eigen::Index lead = 0;
    direction.cwiseAbs().maxCoeff(&lead);
    std::string names;
    int named = 0;
    for (Eigen::Index i = 0; i < direction.size(); ++i) {
      if (std::abs(direction[i]) < kNamed * most) continue;
      const double share = direction[i] / direction[lead];
      names += (named++ ? ", " : "") + value_name(u, columns[i]) + printed(" by %+.2f", share);
    }
    out.push_back((named > 1 ? "together: " : "") + names + ": known to " +
                  millimetres(sigma * most) + " only");
  }
  return out;
}

std::vector<std::string> further_poses(const FrameProblem& problem, const FrameState& state,
                                       const Knowledge& known) {
  const FrameUnknowns& u = problem.unknowns;
  const Eigen::VectorXi columns = metric_columns(u);
  const auto eigen = metric_eigen(u, known);
  Eigen::VectorXd weakest = Eigen::VectorXd::Zero(u.size);
  weakest(columns) = eigen.eigenvectors().col(eigen.eigenvalues().size() - 1);
  const std::vector<Pose> places = candidates(problem, state);
  std::vector<Eigen::MatrixXd> told = told_by(problem, state, places);
  Eigen::MatrixXd covariance = known.covariance / (known.lack_of_fit * known.lack_of_fit);
  const double before = weakest.dot(covariance * weakest);
  std::vector<std::string> out;
  for (int n = 0; n < kFurtherPoses && before > 0.0 && !places.empty(); ++n) {
    double least = kNaN;
    std::size_t best = 0;
    Eigen::MatrixXd best_covariance;
    for (std::size_t i = 0; i < places.size(); ++i) {
      // C − C N (I + C N)⁻¹ C
      Eigen::MatrixXd system = covariance * told[i];
      system.diagonal().array() += 1.0;
      const Eigen::MatrixXd after = solve_square(system, covariance);
      const double variance = weakest.dot(after * weakest);
      if (!(variance >= least)) {
        least = variance;
        best = i;
        best_covariance = after;
      }
    }
    if (!(least >= 0.0 && least < before)) break;  // rounding is all that is left
    const Vector3& p = places[best].position_m;
    out.push_back("a pose at " + components(p) + " m: the least known direction to " +
                  printed("%.0f %%", 100.0 * std::sqrt(least / before)) + " of its error now");
    covariance = best_covariance;
    told[best].setZero();  // elsewhere next time
  }
  return out;
}

std::vector<std::string> stretched_repeats(const FrameProblem& problem) {
  // Cables that pin the platform read the same within a tenth of what the others change by, and
  // that is within what a tape may be wrong by: ten σ.
  const std::size_t pins = static_cast<std::size_t>(problem.basis.cols());
  const double most_change = 10.0 * problem.robot.sigma.direct_length_m;
  int pairs = 0;
  double least = kNaN, most = 0.0, stretch = 0.0;
  bool tensions = false;
  for (std::size_t i = 0; i + 1 < problem.poses.size(); ++i) {
    const Measurement &a = problem.poses[i].reading, &b = problem.poses[i + 1].reading;
    if (problem.poses[i].log != problem.poses[i + 1].log) continue;
    if (a.direct_length_m.size() == 0 || !a.direct_length_m.allFinite()) continue;
    if (b.direct_length_m.size() == 0 || !b.direct_length_m.allFinite()) continue;
    const CableVector change = (b.direct_length_m - a.direct_length_m).cwiseAbs();
    std::vector<double> sorted(change.data(), change.data() + change.size());
    std::sort(sorted.begin(), sorted.end());
    if (sorted.size() <= pins || sorted.back() > most_change) continue;
    if (sorted[pins - 1] > 0.1 * sorted.back()) continue;
    ++pairs;
    least = std::isnan(least) ? sorted.back() : std::min(least, sorted.back());
    most = std::max(most, sorted.back());
    stretch = std::max(stretch, change.cwiseQuotient(a.direct_length_m).maxCoeff());
    tensions = tensions || (a.tension_N.size() > 0 && a.tension_N.allFinite());
  }
  if (pairs == 0 || tensions) return {};
  return {"the stiffness of the cables: in " + std::to_string(pairs) +
          (pairs == 1 ? " pair" : " pairs") +
          " of poses the platform stood still while cables were pulled tighter and read " +
          (pairs == 1 ? "" : millimetres(least) + " to ") + millimetres(most) +
          " less, a stretch of up to " + printed("%.2f %%", 100.0 * stretch) +
          "; a stiffness needs the tensions, and is the change of tension divided by that stretch"};
}

std::string gauge_in_words(const FrameProblem& problem, const Knowledge& known, MirrorTold told) {
  const FrameUnknowns& u = problem.unknowns;
  std::string text = "the readings themselves: they are absolute in the world";
  if (u.by_convention()) {
    text = held_in_words(u);
  } else if (known.free_motions > 0) {
    text = "the frame as a whole agrees best with the robot file's positions in " +
           std::to_string(known.free_motions) +
           (known.free_motions == 1 ? " rigid motion" : " rigid motions") +
           " that the readings do not show";
  }
  if (told == MirrorTold::by_readings) return text;
  return text + "; of the two mirror images it " + image_in_words(told);
}

}  // namespace cdprcal::detail
