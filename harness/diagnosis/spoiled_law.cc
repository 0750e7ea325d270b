#include "harness/diagnosis/spoiled_law.h"

#include <utility>

#include "harness/checks/law_terms.h"

namespace dexcheck {

SpoiledLaw::SpoiledLaw(const Setup& setup, std::unique_ptr<Controller> law, unsigned parts, double factor)
    : law_(std::move(law)),
      spec_(MakeLawSpec(setup.MakeControllerOptions())),
      terms_(setup.model().num_positions(), setup.model().num_velocities(),
             3 * static_cast<int>(setup.fingertips().size())),
      reference_(setup.model().num_velocities(), 3 * static_cast<int>(setup.fingertips().size())),
      actuation_(setup.model()),
      parts_(parts),
      factor_(factor),
      change_(VectorXd::Zero(setup.model().num_velocities())) {}

void SpoiledLaw::Follow(const Trajectory& motion) { law_->Follow(motion); }

void SpoiledLaw::Begin(double t, const Reading& reading) {
  law_->Begin(t, reading);
  has_begun_ = true;
}

void SpoiledLaw::Step(const Reading& reading, double t, Command* command) {
  law_->Step(reading, t, command);
  if (!has_begun_ || command->force_solves == 0) return;
  ReadModelTerms(law_->model(), reading.state, &terms_);
  if (!reference_.Evaluate(spec_, terms_, command->desired, command->demand.F_N)) return;
  change_.setZero();
  for (int i = 0; i < kLawPartCount; ++i) {
    if (((parts_ >> i) & 1U) != 0) change_ += (factor_ - 1.0) * reference_.parts().col(i);
  }
  actuation_.CalcTorque(change_, change_);
  command->tau += change_;
}

}  // namespace dexcheck
