// Rest, judged while it happens, by each sensor's own noise.
//
// The same idea as detect_equilibria on a whole log. Over the last `window_s`:
// - the slope of every reading over the window is what its own noise explains, plus a motion that
//   no estimate notices;
// - so is the scatter of lengths, swivels and angles (χ²): a swing of whole periods has no slope.
//   Tensions may chatter at a platform at rest, and are judged by their slope alone.
// Noise is read off the readings themselves (second differences), so no sensor needs a threshold.
#pragma once

#include <string>
#include <vector>

#include "cdprcal/model/robot.hpp"
#include "cdprcal/startup/robot_sample.hpp"

namespace cdprcal {

struct RestOptions {
  double window_s = 1.0;
  double confidence = 0.99;  ///< of each test; one that fails by chance costs a tenth of a second
  double tolerance = 0.02;   ///< motion over the window that does not matter, in the sensor's σ
};

class RestDetector {
 public:
  RestDetector(int cable_count, const SensorSigma& sigma, const RestOptions& options = {});

  void push(const RobotSample& sample);
  /// Forgets what was before.
  void clear();
  /// Whether the platform rested over the whole window that ends now. Re-judged ten times a window.
  [[nodiscard]] bool at_rest();
  /// Largest motion over the window ÷ what rest allows; above 1 it moves. NaN before a window is
  /// full.
  [[nodiscard]] double ripple() const { return ripple_; }

 private:
  struct Channel {
    double tolerance = 0.0;
    bool angle = false, tension = false;
    std::vector<double> values;  ///< parallel to the group's times
  };
  struct Group {  ///< channels that arrive together
    std::vector<double> time_s;
    std::vector<Channel> channels;
  };
  void add(Group& group, double time_s, const Eigen::Ref<const Eigen::VectorXd>& values,
           std::size_t first);
  [[nodiscard]] double judge(const Channel& channel, const Group& group, double begin_s) const;

  int n_;
  RestOptions options_;
  Group drives_, attitude_;
  double newest_s_ = kNaN, begun_s_ = kNaN, judged_s_ = kNaN, ripple_ = kNaN;
  bool at_rest_ = false;
};

}  // namespace cdprcal
