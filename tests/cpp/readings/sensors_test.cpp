// What stands in the table of sensors is read, written, averaged and weighed: every row of it.
#include "cdprcal/model/sensors.hpp"

#include <gmock/gmock.h>

#include <set>

#include "cdprcal/effects/effect.hpp"
#include "cdprcal/error.hpp"
#include "cdprcal/readings/equilibrium_detection.hpp"
#include "cdprcal/readings/equilibrium_mean.hpp"
#include "cdprcal/readings/measurement.hpp"
#include "cdprcal/readings/noise.hpp"
#include "cdprcal/robot_file/robot_file.hpp"
#include "cdprcal/synthetic/synthetic.hpp"
#include "support/numeric_jacobian.hpp"
#include "support/table2.hpp"

namespace cdprcal::test {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class Sensors : public ::testing::Test {
 protected:
  static constexpr double kNoise = 0.1;  // of the robot's σ
  const Robot robot = load_robot("irma4");
  const int n = robot.cable_count();
  const Log log = [this] {
    SyntheticLogOptions options;
    options.noise = reading_noise(robot.sigma, kNoise, true);
    return synthetic_log(robot, {kTable2[0].tension(), kTable2[5].tension()}, options).log;
  }();
  const SampleRange rest{0, 50};
};

TEST_F(Sensors, HaveNamesOfTheirOwn) {
  std::set<std::string> columns, fields, channels;
  for (const Sensor& sensor : kSensorTable) {
    EXPECT_TRUE(fields.insert(sensor.field()).second) << sensor.field();
    for (int i = 0; i < sensor.columns_of(n); ++i) {
      EXPECT_TRUE(columns.insert(sensor.column(i)).second) << sensor.column(i);
    }
  }
  for (const ChannelRow& row : kChannelTable) {
    EXPECT_TRUE(channels.insert(row.name).second) << row.name;
    EXPECT_NE(row.of().sigma, nullptr);
  }
  EXPECT_STREQ(to_string(Channel::position), "position");
}

TEST_F(Sensors, LogReadsWhatItWrote) {
  const Log again = parse_log(format_log(log), "again");
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    EXPECT_EQ(log.groups()[g]->cols(), kSensorTable[g].columns_of(n));
    EXPECT_EQ(*again.groups()[g], *log.groups()[g]) << kSensorTable[g].name;
  }
}

TEST_F(Sensors, CablesAreCountedByEachThatReadsOneACable) {
  for (std::size_t g = 0; g < kLogGroups; ++g) {
    Log one;
    one.time_s = log.time_s;
    *one.groups()[g] = *log.groups()[g];
    EXPECT_EQ(one.cable_count(), kSensorTable[g].width == kOneACable ? n : 0);
    EXPECT_NO_THROW(validate(one));
    one.groups()[g]->conservativeResize(Eigen::NoChange, kMaxCables + 1);
    EXPECT_THROW(validate(one), InputError) << kSensorTable[g].name;
  }
}

TEST_F(Sensors, MeasurementHoldsTheirMeans) {
  Measurement m = measurement_mean(log, rest, PoseKind::static_pose, n);
  for (std::size_t s = 0; s < kSensors; ++s) {
    const std::span<double> read = readings_of(m, kSensorTable[s]);
    ASSERT_EQ(static_cast<int>(read.size()), kSensorTable[s].columns_of(n));
    for (std::size_t c = 0; c < read.size(); ++c) {
      const auto column = log.groups()[s]->col(static_cast<Eigen::Index>(c));
      EXPECT_NEAR(read[c], column.head(rest.size()).mean(), 1e-9) << kSensorTable[s].column(0);
    }
  }
  for (const ChannelRow& row : kChannelTable) {
    const auto channel = static_cast<Channel>(&row - kChannelTable.data());
    const auto read = readings_of(m, channel);
    if (channel == Channel::angular_velocity) {  // says nothing of a pose
      EXPECT_EQ(read.size(), 0);
      continue;
    }
    EXPECT_EQ(static_cast<int>(read.size()), std::min(row.count, row.of().columns_of(n)));
    EXPECT_EQ(read[0], readings_of(m, row.of())[static_cast<std::size_t>(row.first)]);
  }
}

TEST_F(Sensors, AnAccelerometerTellsThePoseAtRestOnly) {
  Measurement m = measurement_mean(log, rest, PoseKind::static_pose, n);
  EXPECT_EQ(readings_of(m, Channel::specific_force).size(), 3);
  const int spare = spare_readings(m, 6);
  m.acceleration[0] = 0.1;
  EXPECT_EQ(readings_of(m, Channel::specific_force).size(), 0);
  EXPECT_EQ(spare_readings(m, 6), spare - 3);
  m = measurement_mean(log, rest, PoseKind::kinematic_pose, n);
  EXPECT_EQ(readings_of(m, Channel::specific_force).size(), 0);
}

TEST_F(Sensors, NoiseIsSeenAndSpecified) {
  const auto seen = signals(log, rest, {}, robot.sigma);
  const auto absent = signals(Log{}, {0, 0}, {}, robot.sigma);
  const NoiseModel specified = specified_noise(robot.sigma);
  for (std::size_t c = 0; c < kChannels; ++c) {
    const double sigma = robot.sigma.*kChannelTable[c].of().sigma;
    EXPECT_GT(seen[c].sigma, 0.4 * kNoise * sigma) << kChannelTable[c].name;
    EXPECT_LT(seen[c].sigma, 2.5 * kNoise * sigma) << kChannelTable[c].name;
    EXPECT_EQ(absent[c].sigma, sigma);
    EXPECT_EQ(specified.channel[c].pose, sigma);
  }
}

TEST_F(Sensors, RestsAreSeenByEachAloneAndTheirMeansHoldThemAll) {
  Eigen::Index columns = 0;
  for (std::size_t s = 0; s < kSensors; ++s) {
    columns += log.groups()[s]->cols();
    Log one;
    one.time_s = log.time_s;
    *one.groups()[s] = *log.groups()[s];
    const SampleRange all{0, log.sample_count()};
    // A controller may hold tensions where nothing rests, and a platform hums where it does.
    if (log.groups()[s] == &log.tension_N || kSensorTable[s].is_inertial()) {
      EXPECT_THROW(detect_equilibria(one, all, robot.sigma), InputError);
    } else {
      EXPECT_GE(detect_equilibria(one, all, robot.sigma).size(), 1U) << kSensorTable[s].name;
    }
  }
  const EquilibriumMean mean = equilibrium_mean(log, rest);
  EXPECT_EQ(mean.mean.size(), columns);
  EXPECT_TRUE(mean.covariance.allFinite());
}

TEST_F(Sensors, RobotFileKeepsTheirSigma) {
  Robot other = robot;
  double factor = 1.0;
  for (const Sensor& sensor : kSensorTable) {
    if (!sensor.sigma) continue;
    other.sigma.*sensor.sigma *= factor += 0.25;
    Robot wrong = robot;
    wrong.sigma.*sensor.sigma = 0.0;
    EXPECT_THAT([&] { finalise(wrong); },
                ThrowsMessage<InputError>(HasSubstr(std::string("sigma.") + sensor.sigma_name)));
  }
  const Robot again = parse_robot(to_yaml(other), "again");
  for (const Sensor& sensor : kSensorTable) {
    if (!sensor.sigma) continue;
    EXPECT_EQ(again.sigma.*sensor.sigma, other.sigma.*sensor.sigma) << sensor.name;
  }
  // Of sensors that few robots have the file says only what was changed.
  const auto sigma_of = [](const Robot& r) {
    const std::string text = to_yaml(r);
    return text.substr(text.find("sigma:"));
  };
  for_each_absolute(
      [&](const Sensor& sensor, double) {
        EXPECT_THAT(sigma_of(other), HasSubstr(sensor.sigma_name));
        EXPECT_THAT(sigma_of(robot), ::testing::Not(HasSubstr(sensor.sigma_name)));
      },
      robot.sigma);
}

TEST_F(Sensors, AbsoluteReadingsHaveTheirDerivatives) {
  const Pose pose = kTable2[4].pose();
  const auto at = [&](const Pose& p) {
    PoseEvaluation e;
    evaluate_pose(robot, {}, p, StaticsModel::none, {}, {}, true, e);
    return e;
  };
  const PoseEvaluation here = at(pose);
  for_each_absolute(
      [&](const Sensor& sensor, auto& values, auto& by_twist) {
        ASSERT_EQ(static_cast<int>(numbers(values).size()), sensor.columns_of(n));
        const auto numeric = numeric_pose_jacobian(
            [&](const Pose& p) {
              const PoseEvaluation there = at(p);
              Eigen::VectorXd out;
              for_each_absolute(
                  [&](const Sensor& other, auto& moved) {
                    if (&other != &sensor) return;
                    out = Eigen::Map<const Eigen::VectorXd>(
                        numbers(moved).data(), static_cast<Eigen::Index>(numbers(moved).size()));
                  },
                  there);
              return out;
            },
            pose);
        EXPECT_TRUE(jacobian_matches(by_twist, numeric)) << sensor.name;
      },
      here, here.absolute_by_twist);
}

}  // namespace
}  // namespace cdprcal::test
