#include "cdprcal/simulator/dynamics.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "cdprcal/equilibria/equilibrium.hpp"
#include "cdprcal/kinematics/motion.hpp"
#include "cdprcal/simulator/history.hpp"
#include "cdprcal/simulator/written_effects.hpp"

namespace cdprcal {
namespace {

/// Friction turns over between 0.5 and 1.5 mm of cable travel: three elements in parallel, each
/// elastic up to its own travel (Iwan), so that small jitter about a place is forgotten.
constexpr std::array<double, 3> kTurnsOver_m{0.5e-3, 1.0e-3, 1.5e-3};
constexpr double kFrameTime_s = 0.1;  ///< the frame follows its load this slowly
constexpr int kMaxIterations = 100;
constexpr double kTooSmallToHalve_m_s = 1e-7;
constexpr double kVelocityAccepted_m_s = 1e-8;
constexpr double kVelocityTolerance_m_s = 1e-12;  ///< or as far as the arithmetic goes

double damping_rate(double decay_s) { return std::isinf(decay_s) ? 0.0 : 2.0 / decay_s; }

}  // namespace

PlantDynamics::PlantDynamics(const PlantParameters& parameters, const SimulatorOptions& options)
    : p_(parameters),
      winch_options_(options.winch),
      law_{parameters.axial_stiffness_N,
           parameters.linear_density_kg_m * parameters.robot.gravity_m_s2},
      h_(options.step_s),
      free_(parameters.robot),
      translation_damping_N_s_m_(parameters.robot.platform.mass_kg *
                                 damping_rate(options.damping.translation_decay_s)),
      rotation_decay_s_(options.damping.rotation_decay_s),
      drum_kg_(options.winch.drum_inertia_kg_m2 /
               (options.winch.drum_radius_m * options.winch.drum_radius_m)),
      drum_damping_N_s_m_(options.winch.drum_damping_Nms /
                          (options.winch.drum_radius_m * options.winch.drum_radius_m)),
      virtual_kg_(0.0),
      dashpot_N_s_m_(options.winch.tension_gain_m_s_N > 0.0
                         ? 1.0 / options.winch.tension_gain_m_s_N
                         : 4.0 * parameters.robot.platform.mass_kg /
                               parameters.robot.cable_count()),
      n_(parameters.robot.cable_count()),
      direction_left_(options.sensors.random_offsets
                          ? directions_left(n_, RandomNormal(stream(options.seed, 10)))
                          : CableVector(CableVector::Zero(n_))) {
  virtual_kg_ = dashpot_N_s_m_ * options.winch.time_constant_s;
  for (int i = 0; i < n_; ++i) {
    anchor_from_centre_m_[i] =
        p_.robot.cables[i].platform_anchor_m - p_.robot.platform.centre_of_mass_m;
  }
}

Pose PlantDynamics::pose() const {
  return {motion_.centre_of_mass_m - motion_.rotation * p_.robot.platform.centre_of_mass_m,
          motion_.rotation};
}

Vector3 PlantDynamics::pulley_to_anchor(int cable, const Vector3& anchor_m) const {
  return anchor_m - p_.robot.cables[cable].pulley.position_m - winch_[cable].give_m;
}

double PlantDynamics::natural_m(int cable, double payout_m) const {
  return changed(p_.natural_m, payout_m + winch_[cable].slipped_m, cable, time_s());
}

double PlantDynamics::drop_m(int cable) const {
  if (law_.weight_N_m == 0.0) return 0.0;
  return strand_drop_m(law_, strand_[cable].chord_m, std::max(winch_[cable].chord_N, 1e-3));
}

void PlantDynamics::place(const Pose& pose, const CableVector& tension_N) {
  steps_ = 0;
  wound_J_ = 0.0;
  motion_ = {};
  motion_.rotation = pose.rotation.normalized();
  motion_.centre_of_mass_m =
      pose.position_m + motion_.rotation * p_.robot.platform.centre_of_mass_m;
  for (int i = 0; i < n_; ++i) {
    Winch& winch = winch_[i] = {};
    winch.friction.fill(direction_left_[i]);
    arm_m_[i] = motion_.rotation * anchor_from_centre_m_[i];
    // The frame's give and the sag depend on the tension; a few rounds settle them.
    double chord_N = tension_N[i];
    for (int round = 0; round < 8; ++round) {
      const Vector3 q = pulley_to_anchor(i, motion_.centre_of_mass_m + arm_m_[i]);
      winch.chord_N = chord_N;
      strand_[i] = strand_state(p_.robot.cables[i].pulley, q, round == 0 ? 0.0 : drop_m(i));
      if (!strand_[i].valid) return;
      chord_N = chord_tension_N(law_, strand_[i], tension_N[i]);
      winch.give_m = p_.give_m_N(time_s()) * tension_N[i] * strand_[i].chord;
    }
    winch.payout_m = natural_length_m(law_, strand_[i], std::max(chord_N, 1e-3));
    winch.encoder_m = winch.payout_m;
  }
}

void PlantDynamics::set_motion(const Vector3& velocity_m_s, const Vector3& body_rate_rad_s) {
  Vector6 twist;
  twist << velocity_m_s, body_rate_rad_s;
  twist = free_.of(twist);
  motion_.velocity_m_s = twist.head<3>();
  motion_.body_rate_rad_s = twist.tail<3>();
}

double PlantDynamics::mean_tension_N(int i, const StrandState& end, double payout_1_m,
                                     double& by_length_N_m) const {
  const Winch& winch = winch_[i];
  const double grown = natural_m(i, winch.payout_m) - winch.payout_m;
  // The mean of the stiffness at both ends of the step: the same forwards and backwards, so that
  // winding in and out again makes no energy.
  const double k =
      0.5 * (law_.stiffness_N_m(winch.payout_m + grown) + law_.stiffness_N_m(payout_1_m + grown));
  const double viscous =
      2.0 * p_.strand_damping_ratio * std::sqrt(k * p_.robot.platform.mass_kg) / h_;
  const double e0 = strand_[i].length_m - winch.payout_m - grown;
  const double e1 = end.length_m - payout_1_m - grown;
  ChordTension mean;
  if (law_.weight_N_m > 0.0) {
    mean = sagging_tension(law_, 0.5 * (strand_[i].length_m + end.length_m),
                           0.5 * (winch.payout_m + payout_1_m) + grown, end);
    mean.by_length_N_m *= 0.5;
  } else {
    mean = mean_elastic_tension(k, e0, e1);
  }
  if (viscous > 0.0) {
    // Only the taut part of the elongation damps: smooth at slack.
    mean.tension_N += viscous * (std::max(e1, 0.0) - std::max(e0, 0.0));
    if (e1 > 0.0) mean.by_length_N_m += viscous;
  }
  if (mean.tension_N < 0.0) mean = {};
  by_length_N_m = mean.by_length_N_m;
  return mean.tension_N;
}

PlantDynamics::Pull PlantDynamics::pull(int i, const StrandState& end,
                                        const WinchCommand& command) const {
  const Winch& winch = winch_[i];
  const double told = command.values[i];
  Pull out;
  if (command.mode[i] == WinchMode::velocity) {
    const double limit = winch_options_.max_velocity_m_s;
    const double target = std::clamp(told, -limit, limit) / (1.0 + p_.ratio_error[i]);
    const double lag = winch_options_.time_constant_s;
    const double fade = lag > 0.0 ? std::exp(-h_ / lag) : 0.0;
    out.velocity_1_m_s = target + (winch.velocity_m_s - target) * fade;
    out.payout_1_m =
        winch.payout_m + target * h_ + (winch.velocity_m_s - target) * lag * (1.0 - fade);
    out.tension_N = mean_tension_N(i, end, out.payout_1_m, out.by_length_N_m);
    return out;
  }
  // A mass and a dashpot at the drum between the cable's pull and what was told, solved for the
  // speed at the end of the step. The drive's lag makes the mass of a tension loop.
  const bool loop = command.mode[i] == WinchMode::tension;
  const double mass = loop ? virtual_kg_ : drum_kg_;
  const double dashpot = loop ? dashpot_N_s_m_ : drum_damping_N_s_m_;
  const double error_N = loop ? command.reading_error_N[i] : 0.0;
  const CableRun run = cable_run(i);
  double v1 = winch.velocity_m_s;
  double slope = 0.0, by_speed = 0.0;
  // Less speed of pay-out, more pull: one root, which Newton finds within a shrinking bracket.
  double low = -HUGE_VAL, high = HUGE_VAL;
  for (int iteration = 0; iteration < 60; ++iteration) {
    out.payout_1_m = winch.payout_m + 0.5 * h_ * (winch.velocity_m_s + v1);
    out.tension_N = mean_tension_N(i, end, out.payout_1_m, slope);
    const double pulled =
        p_.load_cell_side_N(tension_at_pulley_N(law_, end, out.tension_N), run) + error_N;
    const double balance = mass * (v1 - winch.velocity_m_s) / h_ +
                           0.5 * dashpot * (winch.velocity_m_s + v1) - pulled + told;
    by_speed = mass / h_ + 0.5 * dashpot + 0.5 * h_ * slope;
    const double move = balance / by_speed;
    // Down to the rounding of the length.
    if (std::abs(move) < 1e-13 + 2e-15 * end.length_m * slope / by_speed) {
      v1 -= move;
      break;
    }
    (balance > 0.0 ? high : low) = v1;
    v1 -= move;
    if (!(v1 > low && v1 < high)) v1 = 0.5 * (low + high);
  }
  out.velocity_1_m_s = v1;
  out.by_length_N_m = slope * (1.0 - 0.5 * h_ * slope / by_speed);
  const double limit = winch_options_.max_velocity_m_s;
  if (loop && std::abs(v1) > limit) {  // as a velocity drive at its limit
    out.velocity_1_m_s = std::copysign(limit, v1);
    out.payout_1_m = winch.payout_m + 0.5 * h_ * (winch.velocity_m_s + out.velocity_1_m_s);
    out.tension_N = mean_tension_N(i, end, out.payout_1_m, out.by_length_N_m);
  }
  return out;
}

void PlantDynamics::add_springs(const Vector3& centre_of_mass_m, const Matrix3& rotation,
                                Vector3& force_N, Vector3& moment_Nm) const {
  for (const PlantSpring& spring : p_.springs) {
    const Vector3 arm_m = rotation * spring.point_m;
    const Vector3 pull_N = spring.pull_N(centre_of_mass_m + arm_m);
    force_N += pull_N;
    moment_Nm += arm_m.cross(pull_N);
  }
}

StepStatus PlantDynamics::step(const WinchCommand& command) {
  const double m = p_.robot.platform.mass_kg;
  const Matrix3& inertia = p_.robot.platform.inertia_kg_m2;
  Vector6 written = Vector6::Zero();
  if (!p_.written.empty()) written = written_wrench(p_, *this, this->pose());
  const Vector3 constant_N = p_.robot.gravity_force_N() + written.head<3>();
  const Matrix3 rotation_0 = motion_.rotation.toRotationMatrix();
  const Vector3 momentum_0 = rotation_0 * (inertia * motion_.body_rate_rad_s);
  const double turning = damping_rate(rotation_decay_s_);

  std::array<double, kMaxCables> drop{};
  for (int i = 0; i < n_; ++i) drop[i] = drop_m(i);
  std::array<Pull, kMaxCables> pulls;
  std::array<StrandState, kMaxCables> end;
  std::array<Vector3, kMaxCables> arm_1;
  PlatformMotion next = motion_;
  Eigen::LLT<Matrix6> factor;
  double last_size = HUGE_VAL, last_norm = HUGE_VAL;
  Vector6 move = Vector6::Zero();
  std::array<double, kMaxCables> used_slope;
  used_slope.fill(-1.0);
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Vector3 velocity = 0.5 * (motion_.velocity_m_s + next.velocity_m_s);
    const Vector3 body_rate = 0.5 * (motion_.body_rate_rad_s + next.body_rate_rad_s);
    next.centre_of_mass_m = motion_.centre_of_mass_m + h_ * velocity;
    const Vector3 half_turn = 0.5 * h_ * body_rate;  // Cayley transform as a quaternion
    next.rotation =
        motion_.rotation *
        Eigen::Quaterniond(1.0, half_turn.x(), half_turn.y(), half_turn.z()).normalized();
    const Matrix3 rotation_1 = next.rotation.toRotationMatrix();

    Vector3 force = constant_N - translation_damping_N_s_m_ * velocity;
    Vector3 moment = written.tail<3>() - turning * (rotation_0 * (inertia * body_rate));
    const Matrix3 mean_rotation = 0.5 * (rotation_0 + rotation_1);
    add_springs(motion_.centre_of_mass_m + 0.5 * h_ * velocity, mean_rotation, force, moment);
    bool new_slopes = false;
    for (int i = 0; i < n_; ++i) {
      arm_1[i] = rotation_1 * anchor_from_centre_m_[i];
      const Vector3 q1 = pulley_to_anchor(i, next.centre_of_mass_m + arm_1[i]);
      end[i] = strand_state(p_.robot.cables[i].pulley, q1, drop[i]);
      if (!end[i].valid) return StepStatus::into_pulley;
      pulls[i] = pull(i, end[i], command);
      // The mean direction, corrected so that its product with Δq is Δl exactly: then work and
      // energy agree. The correction is of the order Δq³/l², rounding for moves below a micrometre.
      // With sag the length changes for other reasons, too.
      const Vector3 moved = h_ * velocity + (arm_1[i] - arm_m_[i]);
      Vector3 along = 0.5 * (strand_[i].chord + end[i].chord);
      const double squared = moved.squaredNorm();
      if (squared > 1e-12 && law_.weight_N_m == 0.0) {
        along += ((end[i].length_m - strand_[i].length_m - along.dot(moved)) / squared) * moved;
      }
      const Vector3 pull_N =
          -pulls[i].tension_N * along - Vector3(0.0, 0.0, 0.5 * law_.weight_N_m * end[i].chord_m);
      force += pull_N;
      moment += 0.5 * (arm_m_[i] + arm_1[i]).cross(pull_N);
      new_slopes = new_slopes || used_slope[i] < 0.0 ||
                   std::abs(pulls[i].by_length_N_m - used_slope[i]) > 0.05 * used_slope[i];
    }
    Vector6 residual;
    residual << m * (next.velocity_m_s - motion_.velocity_m_s) - h_ * force,
        rotation_1 * (inertia * next.body_rate_rad_s) - momentum_0 - h_ * moment;
    residual = free_.of(residual);
    // Where stiff strands become slack or taut Newton may overshoot: halve a move that made it
    // worse.
    const double norm = residual.norm();
    if (norm > last_norm && last_size > kTooSmallToHalve_m_s) {
      move *= 0.5;
      last_size *= 0.5;
      next.velocity_m_s += move.head<3>();
      next.body_rate_rad_s += move.tail<3>();
      continue;
    }
    last_norm = norm;
    if (new_slopes) {
      Matrix6 jacobian = Matrix6::Zero();
      jacobian.topLeftCorner<3, 3>().diagonal().setConstant(m +
                                                            0.5 * h_ * translation_damping_N_s_m_);
      jacobian.bottomRightCorner<3, 3>() =
          (1.0 + 0.5 * h_ * turning) * rotation_0 * inertia * rotation_0.transpose();
      for (int i = 0; i < n_; ++i) {
        used_slope[i] = pulls[i].by_length_N_m;
        Vector6 column;
        column << end[i].chord, arm_1[i].cross(end[i].chord);
        jacobian += (0.5 * h_ * h_ * used_slope[i]) * column * column.transpose();
      }
      jacobian = free_.of_stiffness(jacobian);
      factor.compute(jacobian);
    }
    move = factor.solve(residual);
    if (!move.allFinite()) return StepStatus::not_solved;
    move.tail<3>() = rotation_1.transpose() * move.tail<3>();
    next.velocity_m_s -= move.head<3>();
    next.body_rate_rad_s -= move.tail<3>();
    const double size =
        std::max(move.head<3>().cwiseAbs().maxCoeff(), move.tail<3>().cwiseAbs().maxCoeff());
    const bool settled = size < kVelocityTolerance_m_s || (size < 1e-9 && size > 0.3 * last_size);
    last_size = size;
    if (settled) break;
  }
  if (!(last_size < kVelocityAccepted_m_s)) return StepStatus::not_solved;
  for (int i = 0; i < n_; ++i) wound_J_ += wound_J(i, end[i], pulls[i].payout_1_m);
  motion_ = std::move(next);
  motion_.rotation.normalize();
  strand_ = std::move(end);
  arm_m_ = std::move(arm_1);
  finish_step(pulls);
  return StepStatus::done;
}

double PlantDynamics::wound_J(int i, const StrandState& end, double payout_1_m) const {
  const double natural_0 = natural_m(i, winch_[i].payout_m);
  const double natural_1 = natural_0 + payout_1_m - winch_[i].payout_m;
  const double e0 = std::max(0.0, strand_[i].length_m - natural_0);
  const double e1 = std::max(0.0, end.length_m - natural_1);
  return -0.25 * (law_.stiffness_N_m(natural_1) - law_.stiffness_N_m(natural_0)) *
         (e0 * e0 + e1 * e1);
}

void PlantDynamics::finish_step(const std::array<Pull, kMaxCables>& pulls) {
  for (int i = 0; i < n_; ++i) {
    Winch& winch = winch_[i];
    const double travel = pulls[i].payout_1_m - winch.payout_m;
    for (std::size_t e = 0; e < winch.friction.size(); ++e) {
      winch.friction[e] = std::clamp(winch.friction[e] + 2.0 * travel / kTurnsOver_m[e], -1.0, 1.0);
    }
    winch.payout_m = pulls[i].payout_1_m;
    winch.encoder_m = std::clamp(winch.encoder_m, winch.payout_m - p_.encoder_half_play_m,
                                 winch.payout_m + p_.encoder_half_play_m);
    winch.velocity_m_s = pulls[i].velocity_1_m_s;
    winch.chord_N = pulls[i].tension_N;
    if (p_.gives_way()) {
      const double give_m_N = p_.give_m_N(time_s());
      const Vector3 target = give_m_N * winch.chord_N * strand_[i].chord;
      // As the frame gives way the strand loses tension: implicit, or stiff strands make it ring.
      const double share = 1.0 - std::exp(-h_ / kFrameTime_s);
      const double loss = give_m_N * law_.stiffness_N_m(natural_m(i, winch.payout_m));
      winch.give_m += share / (1.0 + share * loss) * (target - winch.give_m);
      const Vector3 q = pulley_to_anchor(i, motion_.centre_of_mass_m + arm_m_[i]);
      strand_[i] = strand_state(p_.robot.cables[i].pulley, q, drop_m(i));
    }
  }
  ++steps_;
}

void PlantDynamics::knock(int cable, const Vector3& impulse_N_s) {
  const Platform& platform = p_.robot.platform;
  Matrix6 inertia = platform.mass_kg * Matrix6::Identity();
  inertia.bottomRightCorner<3, 3>() = platform.inertia_kg_m2;
  Vector6 impulse;
  impulse << impulse_N_s, motion_.rotation.inverse() * arm_m_[cable].cross(impulse_N_s);
  const Vector6 twist = free_.of_stiffness(inertia).llt().solve(free_.of(impulse));
  motion_.velocity_m_s += twist.head<3>();
  motion_.body_rate_rad_s += twist.tail<3>();
}

void PlantDynamics::run_off(int cable, double length_m, bool seen) {
  (seen ? winch_[cable].payout_m : winch_[cable].slipped_m) += length_m;
}

void PlantDynamics::pull_from_now(const PlantSpring& spring) { p_.springs.push_back(spring); }

double PlantDynamics::strand_tension_N(int cable) const {
  return tension_at_pulley_N(law_, strand_[cable], winch_[cable].chord_N);
}

double PlantDynamics::load_cell_tension_N(int cable) const {
  return p_.load_cell_side_N(strand_tension_N(cable), cable_run(cable));
}

double PlantDynamics::encoder_m(int cable) const {
  const double length_m = (1.0 + p_.ratio_error[cable]) * winch_[cable].encoder_m;
  return changed(p_.encoder_m, length_m, cable, time_s());
}

CableRun PlantDynamics::cable_run(int cable) const {
  return {direction(cable), winch_[cable].velocity_m_s, strand_[cable].cable.swivel_rad};
}

double PlantDynamics::direction(int cable) const {
  double sum = 0.0;
  for (const double s : winch_[cable].friction) sum += s;
  return sum / static_cast<double>(winch_[cable].friction.size());
}

PlantEnergy PlantDynamics::energy() const {
  PlantEnergy energy;
  energy.wound_J = wound_J_;
  const Platform& platform = p_.robot.platform;
  energy.kinetic_J =
      0.5 * platform.mass_kg * motion_.velocity_m_s.squaredNorm() +
      0.5 * motion_.body_rate_rad_s.dot(platform.inertia_kg_m2 * motion_.body_rate_rad_s);
  energy.gravity_J = p_.robot.weight_N() * motion_.centre_of_mass_m.z();
  for (const PlantSpring& spring : p_.springs) {
    energy.pulled_J +=
        spring.energy_J(motion_.centre_of_mass_m + motion_.rotation * spring.point_m);
  }
  for (int i = 0; i < n_; ++i) {
    const double natural = natural_m(i, winch_[i].payout_m);
    const double stretch = std::max(0.0, strand_[i].length_m - natural);
    energy.elastic_J += 0.5 * law_.stiffness_N_m(natural) * stretch * stretch;
    if (winch_options_.mode == WinchMode::torque) {
      energy.drums_J += 0.5 * drum_kg_ * winch_[i].velocity_m_s * winch_[i].velocity_m_s;
    }
  }
  return energy;
}

Vector6 PlantDynamics::net_wrench(const Pose& pose, const CableVector& tension_N) const {
  Vector6 written = Vector6::Zero();
  if (!p_.written.empty()) written = written_wrench(p_, *this, pose);
  Vector3 force = p_.robot.gravity_force_N() + written.head<3>();
  Vector3 moment = written.tail<3>();
  const Vector3 centre = pose.position_m + pose.rotation * p_.robot.platform.centre_of_mass_m;
  add_springs(centre, pose.rotation.toRotationMatrix(), force, moment);
  for (int i = 0; i < n_; ++i) {
    const Pulley& pulley = p_.robot.cables[i].pulley;
    const Vector3 arm = pose.rotation * anchor_from_centre_m_[i];
    Vector3 q = centre + arm - pulley.position_m;
    double chord_N = tension_N[i];
    StrandState strand = strand_state(pulley, q, 0.0);
    const bool bends = law_.weight_N_m > 0.0 || p_.gives_way();
    for (int round = 0; bends && strand.valid && round < 8; ++round) {
      q = centre + arm - pulley.position_m - p_.give_m_N(time_s()) * tension_N[i] * strand.chord;
      strand =
          strand_state(pulley, q, strand_drop_m(law_, strand.chord_m, std::max(chord_N, 1e-3)));
      if (strand.valid) chord_N = chord_tension_N(law_, strand, tension_N[i]);
    }
    if (!strand.valid) return Vector6::Constant(kNaN);
    const Vector3 pull_N =
        -chord_N * strand.chord - Vector3(0.0, 0.0, 0.5 * law_.weight_N_m * strand.chord_m);
    force += pull_N;
    moment += arm.cross(pull_N);
  }
  Vector6 wrench;
  wrench << force, moment;
  return wrench;
}

}  // namespace cdprcal
