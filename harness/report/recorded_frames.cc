#include "harness/report/recorded_frames.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/handling/pick_and_place.h"
#include "harness/base/files.h"
#include "harness/engine/mjcf_file.h"
#include "harness/engine/skeleton.h"
#include "harness/log/log_reader.h"

namespace dexcheck {
namespace {

constexpr const char* kCheckPrefix = "check/";
constexpr const char* kForces = "contact/force";

class FramesReader {
 public:
  explicit FramesReader(const std::filesystem::path& path) : path_(path), log_(path) {}

  MjModelPtr ReadModel() const {
    const TemporaryFolder folder;
    log_.ExtractFiles("inputs", folder.path());
    const std::filesystem::path mjcf = FindEmbedded(log_, "mjcf", folder.path());
    try {
      return MakeVisible(LoadMjcf(mjcf));
    } catch (const InputError& error) {
      throw InputError(path_.string() + ": " + error.what());
    }
  }

  RunFrames ReadFrames() const {
    RunFrames run;
    run.source = path_.string();
    run.title = log_.ReadText("scenario");
    run.object_body = ReadObjectBody();
    run.times = ReadSeries("time");
    run.qpos = log_.ReadSignal("engine/qpos");
    for (const double phase : ReadSeries("task/phase")) {
      const bool known = phase >= 0.0 && phase <= static_cast<double>(Phase::kDone);
      run.phases.emplace_back(known ? NameOf(static_cast<Phase>(static_cast<int>(phase))) : "");
    }
    run.position_errors = ReadSeries("object/position_error");
    run.orientation_errors = ReadSeries("object/orientation_error");
    run.joint_errors = ReadSeries("joints/largest_error");
    run.contact_positions = ReadMatrix("contact/position");
    run.contact_forces = ReadMatrix(kForces);
    run.contact_normals = ReadMatrix("contact/normal");
    const RowMatrixXd desired = ReadMatrix("object/X_d");
    const bool has_rows = desired.rows() > 0;
    if (has_rows && desired.cols() >= 3) run.desired_positions = desired.leftCols<3>();
    if (has_rows && desired.cols() >= 6) run.desired_angles = desired.middleCols<3>(3);
    if (const SignalInfo* forces = Find(kForces)) {
      const auto mu = forces->attributes.find("mu");
      if (mu != forces->attributes.end()) run.friction = mu->second;
    }
    for (const SignalInfo& signal : log_.signals()) {
      if (signal.name.starts_with(kCheckPrefix)) run.checks.push_back(ReadCheck(signal));
    }
    OpenForcelessContacts(&run);
    return run;
  }

 private:
  /// Older logs do not say it, and had no other.
  [[nodiscard]] std::string ReadObjectBody() const {
    const std::vector<std::string> texts = log_.ListTexts();
    const bool has = std::find(texts.begin(), texts.end(), "object_body") != texts.end();
    return has ? log_.ReadText("object_body") : "torus";
  }

  [[nodiscard]] const SignalInfo* Find(const std::string& name) const {
    const auto signal = std::find_if(log_.signals().begin(), log_.signals().end(),
                                     [&](const SignalInfo& info) { return info.name == name; });
    return signal == log_.signals().end() ? nullptr : &*signal;
  }

  /// Empty when it was not recorded.
  [[nodiscard]] RowMatrixXd ReadMatrix(const std::string& name) const {
    return Find(name) == nullptr ? RowMatrixXd() : log_.ReadSignal(name);
  }

  [[nodiscard]] std::vector<double> ReadSeries(const std::string& name) const {
    const RowMatrixXd matrix = ReadMatrix(name);
    return {matrix.data(), matrix.data() + matrix.size()};
  }

  [[nodiscard]] CheckSeries ReadCheck(const SignalInfo& signal) const {
    const auto attribute = [&](const char* name) {
      const auto found = signal.attributes.find(name);
      if (found != signal.attributes.end()) return found->second;
      throw InputError(path_.string() + ": " + signal.name + ": has no attribute " + Quote(name));
    };
    const double kind = attribute("kind");
    if (!(kind >= 0.0 && kind <= 4.0) || kind != std::floor(kind)) {
      throw InputError(path_.string() + ": " + signal.name + ": kind must be 0, 1, 2, 3 or 4, got " +
                       FormatNumber(kind));
    }
    return {signal.name.substr(std::strlen(kCheckPrefix)), static_cast<CheckCategory>(static_cast<int>(kind)),
            attribute("bound"), ReadSeries(signal.name)};
  }

  /// Marks contacts that carry nothing as open.
  static void OpenForcelessContacts(RunFrames* run) {
    if (run->contact_forces.size() != run->contact_positions.size()) return;
    for (long row = 0; row < run->contact_forces.rows(); ++row) {
      for (long k = 0; k < run->contacts(); ++k) {
        if (!run->contact_forces.block<1, 3>(row, 3 * k).isZero(0.0)) continue;
        run->contact_positions.block<1, 3>(row, 3 * k).setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    }
  }

  std::filesystem::path path_;
  LogReader log_;
};

}  // namespace

std::filesystem::path FindEmbedded(const LogReader& log, const std::string& kind,
                                   const std::filesystem::path& unpacked) {
  const std::string name = kind + "/" + log.ReadText(kind);
  (void)log.ReadFile("inputs", name);  // which is an error unless the log has it
  if (kind == "mjcf") (void)ListMjcfFiles(unpacked / name);
  return unpacked / name;
}

RecordedFrames ReadRecordedFrames(const std::filesystem::path& run_folder) {
  const FramesReader reader(run_folder / "log.h5");
  RecordedFrames recorded{reader.ReadModel(), reader.ReadFrames()};
  CheckRunFrames(*recorded.model, recorded.frames);
  return recorded;
}

}  // namespace dexcheck
