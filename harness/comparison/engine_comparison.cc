#include "harness/comparison/engine_comparison.h"

#include <fmt/format.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <fstream>
#include <utility>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "harness/base/console.h"
#include "harness/base/files.h"
#include "harness/base/worst.h"
#include "harness/comparison/description_match.h"
#include "harness/comparison/engine_constants.h"
#include "harness/descriptions/description_writer.h"
#include "harness/descriptions/engine_provider.h"
#include "harness/descriptions/mjcf_reader.h"

namespace dexcheck {
namespace {

using ProviderPtr = std::unique_ptr<DynamicsProvider>;
using Change = std::function<void(RobotDescription*)>;

/// Returns what makes the bodies anew from their parts, each changed by `change(R, body)`: R turns the axes
/// along which the file gives the inertia into the link's.
template <typename ChangeBody>
Change ChangeParts(const ChangeBody& change) {
  return [change](RobotDescription* robot) {
    for (DescribedPart& part : robot->parts) change(Matrix3d(part.X_LC.linear()), &part.body);
    FuseParts(robot);
  };
}

template <typename ChangeJoint>
Change ChangeJoints(const ChangeJoint& change) {
  return [change](RobotDescription* robot) {
    for (Joint& joint : robot->spec.joints) change(&joint);
  };
}

/// Euler's step with damping taken at its end has M + h D instead of M.
Change AddImplicitDamping(double step) {
  return ChangeJoints([step](Joint* joint) { joint->armature += step * joint->damping; });
}

void DropWeldedParts(RobotDescription* robot) {
  std::vector<bool> seen(robot->spec.joints.size() + 1, false);
  for (DescribedPart& part : robot->parts) {
    const auto place = static_cast<size_t>(part.joint + 1);
    if (seen[place]) part.body = {};
    seen[place] = true;
  }
  FuseParts(robot);
}

Change SetGravity(double g) {
  return [g](RobotDescription* robot) {
    if (robot->spec.gravity.norm() > 0.0) robot->spec.gravity *= g / robot->spec.gravity.norm();
  };
}

/// A way to read or treat the robot.
struct Setting {
  std::string text;
  Change apply;
};

std::vector<Setting> ListSettings() {
  return {
      {"viscous damping of joints left out", ChangeJoints([](Joint* joint) { joint->damping = 0.0; })},
      {"armature left out", ChangeJoints([](Joint* joint) { joint->armature = 0.0; })},
      {"damping taken at the end of a step of 2 ms (M + h D)", AddImplicitDamping(0.002)},
      {"damping taken at the end of a step of 1 ms (M + h D)", AddImplicitDamping(0.001)},
      {"the rotations (rpy) of the inertials not read",
       ChangeParts([](const Matrix3d& R, MassProperties* body) {
         body->inertia = R.transpose() * body->inertia * R;
       })},
      {"products of inertia left out", ChangeParts([](const Matrix3d& R, MassProperties* body) {
         const Matrix3d own = R.transpose() * body->inertia * R;
         body->inertia = R * Matrix3d(own.diagonal().asDiagonal()) * R.transpose();
       })},
      {"inertias left out, masses kept",
       ChangeParts([](const Matrix3d&, MassProperties* body) { body->inertia.setZero(); })},
      {"inertias read as about the links' origins", ChangeParts([](const Matrix3d&, MassProperties* body) {
         body->inertia -= CalcPointInertia(body->mass, body->com);
       })},
      {"the masses of links on fixed joints lost in fusing", DropWeldedParts},
      {"no gravity", [](RobotDescription* robot) { robot->spec.gravity.setZero(); }},
      {"gravity upwards", [](RobotDescription* robot) { robot->spec.gravity *= -1.0; }},
      {"gravity of 9.800000 m/s^2", SetGravity(9.8)},
      {"gravity of 9.806650 m/s^2", SetGravity(9.80665)},
      {"gravity of 9.810000 m/s^2", SetGravity(9.81)},
  };
}

/// Another description of the robot, which one engine may have read.
struct OtherDescription {
  std::string text;  ///< "as with what only robot.xml states".
  RobotDescription robot;
};

class EngineComparisonRun {
 public:
  EngineComparisonRun(const DescriptionFile& file, const RobotDescription& robot,
                      const EngineComparisonOptions& options)
      : file_(file), robot_(robot), options_(options), model_(robot.spec) {}

  EngineComparisonResult Run(const std::function<bool(long)>& progress) {
    CheckNames();
    for (const EngineComparisonEngine& engine : ListEngineComparisonEngines()) {
      if (IsWanted(engine.name)) Add(engine.name, [&] { return Make(engine.name); });
    }
    for (const std::string& program : options_.programs) {
      const size_t equals = program.find('=');
      Add(program.substr(0, equals), [&] { return MakeProgram(program.substr(equals + 1)); });
    }
    if (providers_.size() < 2) {
      std::string text =
          "engine_comparison: two engines must be there, got " + std::to_string(providers_.size());
      for (const std::string& absent : result_.absent) text += "; " + absent;
      throw InputError(text);
    }
    Compare(progress);
    FormGroups();
    if (!result_.Agrees()) Explain();
    for (const ProviderPtr& provider : providers_) result_.names.push_back(provider->name());
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool IsWanted(const std::string& name) const {
    return options_.engines.empty() || Contains(options_.engines, name);
  }

  void CheckNames() const {
    std::vector<std::string> known;
    for (const EngineComparisonEngine& engine : ListEngineComparisonEngines()) known.push_back(engine.name);
    for (const std::string& name : options_.engines) {
      if (Contains(known, name)) continue;
      throw InputError("--engines: must be of " + JoinNames(known) + ", got " + Quote(name));
    }
    for (const std::string& program : options_.programs) {
      if (program.find('=') != std::string::npos && !program.starts_with('=')) continue;
      throw InputError("--engine: must be NAME=COMMAND, got " + Quote(program));
    }
  }

  /// Adds a provider; one that cannot be evaluated is named as absent and left out.
  void Add(const std::string& name, const std::function<ProviderPtr()>& make) {
    try {
      ProviderPtr provider = make();
      // One state suffices to leave out providers that cannot answer before the comparison.
      DynamicsState state;
      state.q.setZero(model_.num_positions());
      state.xi.setZero(model_.num_velocities());
      MakeFeed()(&state);
      provider->SetState(state);
      providers_.push_back(std::move(provider));
    } catch (const Error& error) {
      result_.absent.push_back(name + ": " + error.what());
      result_.lacks_requested = result_.lacks_requested || !options_.engines.empty();
    }
  }

  ProviderPtr Make(const std::string& name) {
    if (name == "analytic") return std::make_unique<AnalyticProvider>(model_, "analytic model");
    if (name == "mujoco") return MakeMujoco();
    if (name == "mujoco3") {
      const std::filesystem::path script = options_.programs_folder / "mujoco3.mjs";
      RequireProgram(script);
      if (!options_.states.ignore.empty() && !options_.mjcf.empty()) {
        throw InputError("reads " + options_.mjcf.filename().string() +
                         " with its own constants of joints, which --ignore cannot change");
      }
      std::string command =
          "node " + QuoteForShell(script.string()) + " " + QuoteForShell(MujocoFile().string());
      if (!options_.node_modules.empty()) command += " " + QuoteForShell(options_.node_modules.string());
      return MakeProgram(command);
    }
    if (file_.format() != RobotFormat::kUrdf) throw InputError("reads a URDF only");
    const std::filesystem::path program = options_.programs_folder / ("dexcheck-" + name);
    RequireProgram(program);
    return MakeProgram(QuoteForShell(program.string()) + " " + QuoteForShell(file_.path().string()));
  }

  static void RequireProgram(const std::filesystem::path& path) {
    if (!Exists(path)) throw InputError("is not installed: " + path.string());
  }

  ProviderPtr MakeProgram(const std::string& command) {
    return std::make_unique<ProgramProvider>(command, robot_, options_.program_options);
  }

  /// Returns the MJCF, or the URDF in the form that MuJoCo's importer needs.
  const std::filesystem::path& MujocoFile() {
    if (!mujoco_file_.empty()) return mujoco_file_;
    if (!options_.mjcf.empty()) {
      mujoco_file_ = options_.mjcf;
    } else if (file_.format() == RobotFormat::kUrdf) {
      folder_.emplace();
      mujoco_file_ = folder_->path() / "robot.urdf";
      std::ofstream(mujoco_file_) << WriteEngineUrdf(file_.text(), file_.path().string(),
                                                     robot_.spec.base.type == BaseType::kFloating);
    } else if (file_.format() == RobotFormat::kMjcf) {
      mujoco_file_ = file_.path();
    } else {
      throw InputError("reads no parameter file; --mjcf names what it reads instead");
    }
    return mujoco_file_;
  }

  /// Loads a file into MuJoCo; a refusal names the file that the user knows.
  [[nodiscard]] MjModelPtr Load(const std::filesystem::path& path) const {
    if (path == file_.path()) return file_.CopyEngine();
    try {
      return LoadMjcf(path);
    } catch (const InputError& error) {
      std::string text = error.what();
      const size_t at = text.find(path.string());
      if (folder_ && at != std::string::npos) text.replace(at, path.string().size(), file_.path().string());
      throw InputError(text);
    }
  }

  ProviderPtr MakeMujoco() {
    const std::filesystem::path path = MujocoFile();
    MjModelPtr engine = Load(path);
    if (folder_) {  // the file is a URDF
      for (int k = 0; k < 3; ++k) engine->opt.gravity[k] = robot_.spec.gravity[k];
    }
    TakeIgnored(robot_.spec, options_.states.ignore, engine.get());
    RobotDescription completed = robot_;
    const std::string file =
        options_.mjcf.empty() ? file_.path().filename().string() : path.filename().string();
    const Completion completion = CompleteFromEngine(*engine, file, &completed);
    const Base& base = completed.spec.base;
    if (base.type != robot_.spec.base.type) {
      throw InputError("its base floats, and that of " + file_.path().filename().string() +
                       " is fixed (--floating)");
    }
    const bool has_moved =
        std::ranges::any_of(robot_.spec.frames, [&](const Frame& frame) { return frame.name == base.link; });
    if (base.type == BaseType::kFloating && has_moved) {
      throw InputError("its base is " + Quote(base.link) + ", which another frame than " +
                       Quote(robot_.spec.base.link) + " belongs to");
    }
    if (!options_.mjcf.empty()) {
      for (const auto& notes : {completion.notes, completion.not_compared}) {
        for (const std::string& note : notes) result_.notes.push_back("MuJoCo: " + note);
      }
      others_.push_back({"as with what only " + file + " states: armature, damping, gravity", completed});
    }
    NoteCompiledInertias(*engine, path.string(), completed);
    NoteOtherForces(Adapter(RobotModel(completed.spec), *engine, path.string()));
    return std::make_unique<EngineProvider>(completed.spec, std::move(engine), path.string(),
                                            std::string("MuJoCo ") + mj_versionString());
  }

  /// The description with the bodies that MuJoCo's compiler made of it: it diagonalises inertias, to 1e-6.
  void NoteCompiledInertias(const mjModel& engine, const std::string& source, RobotDescription completed) {
    const RobotDescription compiled = ReadMjcfDescription(engine, source);
    double largest = 0.0;
    for (size_t i = 0; i < completed.spec.joints.size(); ++i) {
      Joint& joint = completed.spec.joints[i];
      const int other = IndexOf(compiled.spec.joints, joint.name, &Joint::name);
      if (other < 0) return;
      const auto j = static_cast<size_t>(other);
      // The bodies are moved from the compiled joint's frame to the link's own, through the frame that both
      // have.
      const MassProperties body = ExpressIn(compiled.spec.joints[j].body,
                                            completed.joints[i].X_iL * compiled.joints[j].X_iL.inverse());
      const double size = joint.body.inertia.norm();
      if (size > 0.0) largest = Worst(largest, (body.inertia - joint.body.inertia).norm() / size);
      joint.body = body;
    }
    others_.push_back(
        {fmt::format("as with the inertias that its compiler made of the file, up to {:.0e} off", largest),
         completed});
  }

  /// Notes the passive forces that the engine counts as friction and that no description has.
  void NoteOtherForces(const Adapter& adapter) {
    constexpr const char* kChecks[] = {"joint_spring", "tendon_spring", "tendon_damping", "fluid"};
    std::vector<std::string> parts;
    for (const ConstantFinding& finding : CheckConstants(adapter).findings) {
      if (!Contains(kChecks, finding.check)) continue;
      std::string part = finding.check;
      std::ranges::replace(part, '_', ' ');
      parts.push_back(part + (finding.where.empty() ? "" : " of " + finding.where));
    }
    if (!parts.empty())
      other_forces_ = "its friction has forces that no description has: " + JoinNames(parts);
  }

  [[nodiscard]] StateFeed MakeFeed() const { return FeedRandomStates(model_, options_.states); }

  void Compare(const std::function<bool(long)>& progress) {
    std::vector<DynamicsProvider*> providers;
    for (const ProviderPtr& provider : providers_) providers.push_back(provider.get());
    TermComparison comparison(model_, kAskedOfPrograms, providers);
    result_.samples = CompareAtStates(MakeFeed(), progress, &comparison);
    result_.pairs = comparison.TakePairs();
    for (ComparedPair& pair : result_.pairs) JudgeByTolerance(options_.tolerance, &pair.terms);
  }

  /// Each provider joins the first group with all of which it agrees.
  void FormGroups() {
    const auto agree = [&](size_t a, size_t b) {
      const auto pair = std::ranges::find_if(result_.pairs, [&](const ComparedPair& candidate) {
        return std::pair(candidate.first, candidate.second) == std::minmax({a, b});
      });
      return std::ranges::none_of(pair->terms, &CheckRecord::failed);
    };
    for (size_t one = 0; one < providers_.size(); ++one) {
      const auto fits = [&](const std::vector<size_t>& group) {
        return std::ranges::all_of(group, [&](size_t member) { return agree(member, one); });
      };
      const auto group = std::ranges::find_if(result_.groups, fits);
      if (group != result_.groups.end()) {
        group->push_back(one);
      } else {
        result_.groups.push_back({one});
      }
    }
    std::ranges::stable_sort(result_.groups,
                             [](const auto& a, const auto& b) { return a.size() > b.size(); });
  }

  /// The setting under which the analytic model of the description has the terms of a provider that disagrees
  /// with it: "as with no gravity"; nothing when no setting explains it.
  std::optional<std::string> FindSetting(DynamicsProvider* provider) const {
    const auto explains = [&](const RobotDescription& changed) {
      try {
        AnalyticProvider model(changed.spec, "");
        return AgreeAtFirst(model_, &model, provider, MakeFeed(), options_.tolerance);
      } catch (const InputError&) {
        return false;  // no body is like that
      }
    };
    for (const OtherDescription& other : others_) {
      if (explains(other.robot)) return other.text;
    }
    // Alone first, then two at a time: an engine may leave out damping and misread inertials.
    const std::vector<Setting> settings = ListSettings();
    for (const bool alone : {true, false}) {
      for (size_t i = 0; i < settings.size(); ++i) {
        for (size_t j = alone ? i : i + 1; j < (alone ? i + 1 : settings.size()); ++j) {
          RobotDescription changed = robot_;
          settings[i].apply(&changed);
          if (!alone) settings[j].apply(&changed);
          if (explains(changed))
            return "as with " + settings[i].text + (alone ? "" : ", and " + settings[j].text);
        }
      }
    }
    return std::nullopt;
  }

  /// Why those outside of the largest group differ from the description's analytic model.
  void Explain() {
    const auto make_feed = [this] { return MakeFeed(); };
    AnalyticProvider model(model_, "");
    for (const ProviderPtr& owned : providers_) {
      DynamicsProvider* const provider = owned.get();
      if (AgreeAtFirst(model_, &model, provider, make_feed(), options_.tolerance)) continue;
      std::optional<std::string> setting = FindSetting(provider);
      auto* const by_layout = dynamic_cast<LayoutProvider*>(provider);
      if (!setting && by_layout != nullptr && by_layout->layout().is_floating()) {
        const std::optional<BaseConvention> other = FindOtherConvention(model_, &model, by_layout, make_feed);
        if (other) setting = "as with its base in " + Describe(*other);
      }
      const bool is_mujoco = dynamic_cast<EngineProvider*>(provider) != nullptr;
      if (!setting && is_mujoco && !other_forces_.empty()) setting = other_forces_;
      result_.settings.push_back(provider->name() + ": " +
                                 setting.value_or("no setting that is known explains it"));
    }
  }

  const DescriptionFile& file_;
  const RobotDescription& robot_;
  const EngineComparisonOptions& options_;
  RobotModel model_;
  std::optional<TemporaryFolder> folder_;
  std::filesystem::path mujoco_file_;
  std::vector<OtherDescription> others_;
  std::string other_forces_;  // of the engine that is linked, in words
  std::vector<ProviderPtr> providers_;
  EngineComparisonResult result_;
};

}  // namespace

const std::vector<EngineComparisonEngine>& ListEngineComparisonEngines() {
  static const std::vector<EngineComparisonEngine> engines = {
      {"analytic", "the analytic model of the file"},
      {"mujoco", "MuJoCo " + std::string(mj_versionString()) + ", which is linked into this program"},
      {"mujoco3", "MuJoCo 3 under Node (npm package @mujoco/mujoco)"},
      {"bullet", "Bullet's btMultiBody"},
      {"kdl", "the Orocos Kinematics and Dynamics Library"},
      {"simbody", "Simbody"},
  };
  return engines;
}

EngineComparisonResult RunEngineComparison(const DescriptionFile& file, const RobotDescription& robot,
                                           const EngineComparisonOptions& options,
                                           const std::function<bool(long)>& progress) {
  return EngineComparisonRun(file, robot, options).Run(progress);
}

}  // namespace dexcheck
