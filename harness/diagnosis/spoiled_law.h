#pragma once

// Laws that are wrong on purpose: do the checks find them, and name the part?

#include <memory>

#include "controller/control/controller.h"
#include "harness/checks/law_reference.h"
#include "harness/scenario/setup.h"

namespace dexcheck {

/// A controller whose torques have some summands of (55) `factor` times: 0 drops them. It spoils what is sent
/// from t = 0 on; what the law says that it demands stays right, as in a law whose author does not know of
/// the mistake.
class SpoiledLaw final : public Controller {
 public:
  /// @param law of a scenario that is no task. @param parts bits by LawPart, of LawPartName.
  SpoiledLaw(const Setup& setup, std::unique_ptr<Controller> law, unsigned parts, double factor);

  void Follow(const Trajectory& motion) override;
  void Begin(double t, const Reading& reading) override;
  void Step(const Reading& reading, double t, Command* command) override;
  [[nodiscard]] const GraspModel& model() const override { return law_->model(); }

 private:
  std::unique_ptr<Controller> law_;
  LawSpec spec_;
  LawTerms terms_;
  LawReference reference_;
  ActuationMap actuation_;
  unsigned parts_;
  double factor_;
  bool has_begun_ = false;
  VectorXd change_;  // n
};

}  // namespace dexcheck
