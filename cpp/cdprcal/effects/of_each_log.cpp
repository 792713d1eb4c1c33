#include "cdprcal/effects/of_each_log.hpp"

#include <algorithm>
#include <vector>

#include "cdprcal/effects/catalogue.hpp"

namespace cdprcal {
namespace {

class OfEachLog final : public Effect {
 public:
  explicit OfEachLog(std::shared_ptr<const Effect> of) : of_(std::move(of)), info_(of_->info()) {
    info_.scope = EffectScope::run;
  }
  const EffectInfo& info() const override { return info_; }
  void apply(const EffectValues& values, Robot& robot) const override { of_->apply(values, robot); }
  bool moves_cables() const override { return of_->moves_cables(); }
  EffectValues stated_sigma(const Robot& robot) const override { return of_->stated_sigma(robot); }
  void correct_tension(const EffectContext& context, const EffectValues& values,
                       CableVector& tension_N) const override {
    of_->correct_tension(context, values, tension_N);
  }
  void add_to_readings(const EffectContext& context, const EffectValues& values,
                       PoseEvaluation& evaluation) const override {
    of_->add_to_readings(context, values, evaluation);
  }
  void columns(const EffectContext& context, const EffectValues& values,
               EffectColumns out) const override {
    of_->columns(context, values, out);
  }
  std::vector<int> learnt_widths(int cables) const override { return of_->learnt_widths(cables); }
  Shows shows() const override { return of_->shows(); }

  [[nodiscard]] const std::shared_ptr<const Effect>& of() const { return of_; }

 private:
  std::shared_ptr<const Effect> of_;
  EffectInfo info_;
};

}  // namespace

std::shared_ptr<const Effect> of_each_log(const std::shared_ptr<const Effect>& effect) {
  static const std::vector<std::shared_ptr<const OfEachLog>> all = [] {
    std::vector<std::shared_ptr<const OfEachLog>> out;
    for (const auto& known : effect_catalogue()) {
      if (known->info().scope != EffectScope::robot) continue;
      out.push_back(std::make_shared<OfEachLog>(known));
    }
    return out;
  }();
  const auto found = std::ranges::find(all, effect, &OfEachLog::of);
  return found == all.end() ? nullptr : *found;
}

std::shared_ptr<const Effect> of_all_logs(const std::shared_ptr<const Effect>& effect) {
  const auto* own = dynamic_cast<const OfEachLog*>(effect.get());
  return own ? own->of() : effect;
}

bool is_of_each_log(const Effect& effect) {
  return dynamic_cast<const OfEachLog*>(&effect) != nullptr;
}

}  // namespace cdprcal
