#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/run/controller_peers.h"

namespace dexcheck {

LibraryPeer::LibraryPeer(std::unique_ptr<ForeignLibrary> library, const OwnControllerSetup& setup)
    : library_(std::move(library)),
      setup_(setup),
      step_(library_->Find<const char*(void*, const double*, double*)>("dexcheck_step")) {}

LibraryPeer::~LibraryPeer() {
  const auto close = library_->Find<void(void*)>("dexcheck_close");
  if (controller_ == nullptr || close == nullptr) return;
  try {
    library_->Guard([&] { close(controller_); });
  } catch (const ControllerFailure&) {  // the run has its verdict
  }
}

uint32_t LibraryPeer::Greet(const dexcheck_hello& hello, std::span<const double> joint_gains) {
  const uint32_t protocol = library_->Find<uint32_t()>("dexcheck_protocol")();
  if (protocol != DEXCHECK_PROTOCOL) {
    throw InputError(setup_.name + ": is of protocol " + std::to_string(protocol) + ", this program of " +
                     std::to_string(DEXCHECK_PROTOCOL));
  }
  const auto open =
      library_->Find<void*(const dexcheck_hello*, const char*, const char*, const double*, uint32_t*)>(
          "dexcheck_open");
  if (open == nullptr || step_ == nullptr)
    throw InputError(setup_.name + ": must have dexcheck_open and dexcheck_step");
  hello_ = hello;
  joint_gains_.assign(joint_gains.begin(), joint_gains.end());
  uint32_t flags = 0;
  library_->Guard(
      [&] {
        controller_ = open(&hello_, setup_.robot_text.c_str(), setup_.scenario_text.c_str(),
                           joint_gains_.empty() ? nullptr : joint_gains_.data(), &flags);
      },
      ForeignLibrary::kPatience);
  if (controller_ == nullptr) throw InputError(setup_.name + ": made no controller");
  const bool takes_parameters = library_->Find<void>("dexcheck_set_parameter") != nullptr;
  return takes_parameters ? flags | DEXCHECK_PARAMETERS : flags & ~uint32_t{DEXCHECK_PARAMETERS};
}

void LibraryPeer::SetParameters() {
  const auto set = library_->Find<const char*(void*, const char*, double)>("dexcheck_set_parameter");
  for (const auto& [parameter, value] : setup_.own.parameters) {
    std::string problem;
    library_->Guard([&, name = parameter.c_str(), number = value] {
      if (const char* text = set(controller_, name, number)) problem = Abbreviate(text);
    });
    if (!problem.empty()) throw InputError(setup_.name + ": controller." + parameter + ": " + problem);
  }
}

void LibraryPeer::Begin() {
  if (const auto begin = library_->Find<void(void*)>("dexcheck_begin"))
    library_->Guard([&] { begin(controller_); }, ForeignLibrary::kPatience);
}

void LibraryPeer::Step(std::span<double> request, std::span<double> torques) {
  const char* problem = nullptr;
  library_->Guard([&] { problem = step_(controller_, request.data() + 1, torques.data()); });
  if (problem != nullptr) throw ControllerFailure(setup_.name + ": " + Abbreviate(problem));
}

}  // namespace dexcheck
