#pragma once

// A program of the user's that computes terms at states: the protocol is in README.md.

#include <string>

#include "harness/descriptions/program_layout.h"
#include "harness/descriptions/program_process.h"

namespace dexcheck {

/// Version of the protocol that this program speaks.
inline constexpr int kProgramProtocol = 1;

struct ProgramOptions {
  double seconds = 10.0;  ///< Within which each result must come.
};

/// A running program as a provider.
class ProgramProvider : public LayoutProvider {
 public:
  /// Starts it and says hello. @param robot outlives this.
  /// @throws ProgramError when it dies or hangs, InputError for what it writes that is no result; one line.
  ProgramProvider(const std::string& command, const RobotDescription& robot,
                  const ProgramOptions& options = {});

  /// As it calls itself, or its command.
  [[nodiscard]] const std::string& name() const override { return name_; }
  TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  nlohmann::json Query(const nlohmann::ordered_json& request);

  const RobotDescription& robot_;
  ProgramProcess process_;
  std::string source_;  // for messages
  std::string name_;
};

}  // namespace dexcheck
