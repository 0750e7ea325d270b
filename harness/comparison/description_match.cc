#include "harness/comparison/description_match.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/descriptions/alike_names.h"
#include "harness/descriptions/constant_table.h"
#include "harness/descriptions/mjcf_reader.h"
#include "harness/descriptions/robot_description.h"
#include "harness/engine/engine.h"

namespace dexcheck {
namespace {

std::string FileName(const RobotSpec& spec) { return std::filesystem::path(spec.source).filename().string(); }

/// Lets each of the two take from the other what it does not state.
class Matching {
 public:
  Matching(RobotDescription* a, RobotDescription* b, const std::vector<std::string>& ignore)
      : a_(*a),
        b_(*b),
        ignore_(ignore),
        b_of_a_(MatchJoints(a_.spec, b_.spec)),
        a_of_b_(MatchJoints(b_.spec, a_.spec)) {}

  Completion Run() {
    TakeBase();
    RequireSameMechanism();
    TakeGravity();
    TakeNames();
    for (const DescribedConstant& constant : ListDescribedConstants())
      Contains(ignore_, constant.word) ? Ignore(constant) : Take(constant);
    IgnoreAll("coupling", [](Joint* joint, DescribedJoint*) { joint->coupling.reset(); });
    IgnoreAll("effort", [](Joint*, DescribedJoint* joint) { joint->forces.reset(); });
    TakeRanges();
    DropFrames();
    return std::move(result_);
  }

 private:
  void RequireSameMechanism() const {
    const auto list = [](const RobotSpec& spec, const std::vector<int>& match) {
      std::vector<std::string> missing;
      for (size_t i = 0; i < match.size(); ++i) {
        if (match[i] < 0) missing.push_back("joint " + Quote(spec.joints[i].name));
      }
      return missing.empty() ? "" : "; only in " + spec.source + ": " + JoinNames(missing);
    };
    const std::string missing = list(a_.spec, b_of_a_) + list(b_.spec, a_of_b_);
    if (!missing.empty()) throw InputError(b_.spec.source + ": does not match " + a_.spec.source + missing);
    const Base& base_a = a_.spec.base;
    const Base& base_b = b_.spec.base;
    if (base_a.type != base_b.type || base_a.velocity != base_b.velocity) {
      throw InputError(b_.spec.source + ": base: must move as that of " + a_.spec.source);
    }
    for (size_t i = 0; i < b_of_a_.size(); ++i) {
      const Joint& joint = a_.spec.joints[i];
      const Joint& other = b_.spec.joints[static_cast<size_t>(b_of_a_[i])];
      const std::string key = b_.spec.source + ": joint " + Quote(joint.name) + ": ";
      if (joint.type != other.type) {
        throw InputError(key + "must be " + NameOf(joint.type) + " as in " + a_.spec.source);
      }
      const int parent = joint.parent < 0 ? -1 : b_of_a_[static_cast<size_t>(joint.parent)];
      if (other.parent == parent) continue;
      const auto name = [](const RobotSpec& spec, int index) {
        return index < 0 ? std::string("the base") : Quote(spec.joints[static_cast<size_t>(index)].name);
      };
      throw InputError(key + "must come after " + name(a_.spec, joint.parent) + " as in " + a_.spec.source +
                       ", comes after " + name(b_.spec, other.parent));
    }
  }

  /// A base that one file does not state moves as the other one's; a floating one's frame is that of the link
  /// of one name.
  void TakeBase() {
    const auto take = [this](RobotDescription* robot, const RobotDescription& other) {
      if (robot->states_base || other.spec.base.type != BaseType::kFloating) return;
      LetBaseFloat(robot);
      result_.notes.push_back("base: " + FileName(robot->spec) +
                              " does not say how its root moves; it floats as that of " +
                              FileName(other.spec));
    };
    take(&a_, b_);
    take(&b_, a_);
    if (a_.spec.base.type != BaseType::kFloating || b_.spec.base.type != BaseType::kFloating) return;
    if (!MoveBaseTo(a_.spec.base.link, &b_)) MoveBaseTo(b_.spec.base.link, &a_);
  }

  void TakeGravity() {
    if (a_.states_gravity == b_.states_gravity) return;
    (a_.states_gravity ? b_ : a_).spec.gravity = (a_.states_gravity ? a_ : b_).spec.gravity;
    result_.not_compared.push_back("gravity: only " + FileName((a_.states_gravity ? a_ : b_).spec) +
                                   " states it, " + FormatNumbers(a_.spec.gravity));
  }

  /// Links that joints of one name move are the same one.
  void TakeNames() {
    std::vector<std::string> renamed;
    const auto rename = [&](const std::string& name, std::string* other) {
      if (name == *other) return;
      renamed.push_back(Quote(*other) + " is " + Quote(name));
      *other = name;
    };
    rename(a_.spec.base.link, &b_.spec.base.link);
    for (size_t i = 0; i < b_of_a_.size(); ++i) {
      rename(a_.spec.joints[i].link, &b_.spec.joints[static_cast<size_t>(b_of_a_[i])].link);
    }
    if (!renamed.empty()) result_.notes.push_back("links by other names: " + JoinNames(renamed));
  }

  template <typename Visit>
  void ForJoints(const Visit& visit) {
    for (size_t i = 0; i < b_of_a_.size(); ++i) visit(i, static_cast<size_t>(b_of_a_[i]));
  }

  void Take(const DescribedConstant& constant) {
    ForJoints([&](size_t i, size_t j) {
      double& own = a_.spec.joints[i].*constant.value;
      double& other = b_.spec.joints[j].*constant.value;
      if (!(a_.joints[i].*constant.states)) own = other;
      if (!(b_.joints[j].*constant.states)) other = own;
    });
  }

  void Ignore(const DescribedConstant& constant) {
    std::vector<std::string> names;
    ForJoints([&](size_t i, size_t j) {
      const double own = a_.spec.joints[i].*constant.value;
      double& other = b_.spec.joints[j].*constant.value;
      if (own != other) names.push_back(a_.spec.joints[i].name);
      other = own;
      a_.joints[i].*constant.states = b_.joints[j].*constant.states = false;
    });
    result_.not_compared.push_back(std::string(constant.word) + ": ignored" +
                                   (names.empty() ? ""
                                                  : ", though it differs at " + JoinNames(names) +
                                                        "; terms are with that of " + FileName(a_.spec)));
  }

  /// @param forget takes what the word means out of a joint.
  template <typename Forget>
  void IgnoreAll(const std::string& word, const Forget& forget) {
    if (!Contains(ignore_, word)) return;
    for (RobotDescription* const robot : {&a_, &b_}) {
      for (size_t i = 0; i < robot->joints.size(); ++i) forget(&robot->spec.joints[i], &robot->joints[i]);
    }
    result_.not_compared.push_back(word + ": ignored");
  }

  void TakeRanges() {
    std::map<std::string, std::vector<std::string>> taken;  // by the source that states it
    ForJoints([&](size_t i, size_t j) {
      const bool in_a = a_.joints[i].states_range;
      if (in_a == b_.joints[j].states_range) return;
      Joint& own = a_.spec.joints[i];
      Joint& other = b_.spec.joints[j];
      if (own.lower != other.lower || own.upper != other.upper)
        taken[FileName((in_a ? a_ : b_).spec)].push_back(own.name);
      const Joint& stated = in_a ? own : other;
      Joint& silent = in_a ? other : own;
      silent.lower = stated.lower;
      silent.upper = stated.upper;
    });
    for (const auto& [source, names] : taken)
      result_.not_compared.push_back("range: only " + source + " states it, for " + JoinNames(names));
  }

  void DropFrames() {
    const auto drop = [this](RobotDescription* robot, const RobotDescription& other) {
      std::vector<std::string> dropped;
      std::erase_if(robot->spec.frames, [&](const Frame& frame) {
        const bool lacks = std::ranges::none_of(
            other.spec.frames, [&](const Frame& candidate) { return candidate.name == frame.name; });
        if (lacks) dropped.push_back(frame.name);
        return lacks;
      });
      if (!dropped.empty())
        result_.not_compared.push_back("frames only in " + FileName(robot->spec) + ": " + JoinNames(dropped));
    };
    drop(&a_, b_);
    drop(&b_, a_);
  }

  RobotDescription& a_;
  RobotDescription& b_;
  const std::vector<std::string>& ignore_;
  std::vector<int> b_of_a_;
  std::vector<int> a_of_b_;
  Completion result_;
};

}  // namespace

Completion CompleteEachOther(RobotDescription* a, RobotDescription* b,
                             const std::vector<std::string>& ignore) {
  const std::vector<std::string> renamed = TakeJointNames(*a, b);
  Completion completion = Matching(a, b, ignore).Run();
  completion.notes.insert(completion.notes.begin(), renamed.begin(), renamed.end());
  return completion;
}

Completion CompleteFromEngine(const mjModel& engine, const std::string& source, RobotDescription* robot,
                              const std::vector<std::string>& ignore) {
  RobotDescription other = ReadMjcfDescription(engine, source);
  return CompleteEachOther(&other, robot, ignore);
}

Completion CompleteTable(const mjModel& engine, const std::string& source, RobotDescription* robot,
                         const std::vector<std::string>& ignore) {
  RobotDescription other = *robot;
  other.spec.source = source;
  for (Joint& joint : other.spec.joints) {
    const int id = FindByName(engine, mjOBJ_JOINT, joint.name);
    for (const DescribedConstant& constant : ListDescribedConstants()) {
      if (id >= 0) joint.*constant.value = (engine.*constant.engine)[engine.jnt_dofadr[id]];
    }
  }
  return CompleteEachOther(&other, robot, ignore);
}

Completion CompletePair(const std::vector<std::string>& ignore, const RobotPart& part,
                        std::array<RobotDescription, 2>* sides) {
  auto& [first, second] = *sides;
  std::vector<std::string> of_part;
  int held = 0;
  if (!part.empty()) of_part = TakePart(part, &first, &second, &held);
  const bool is_named_by_second = second.format == RobotFormat::kMjcf && part.empty();
  Completion completion =
      CompleteEachOther(is_named_by_second ? &second : &first, is_named_by_second ? &first : &second, ignore);
  completion.not_compared.insert(completion.not_compared.begin(), of_part.begin(), of_part.end());
  completion.has_link_frames = AddLinkFrames(&first, &second);
  completion.held = held;
  return completion;
}

void TakeIgnored(const RobotSpec& robot, const std::vector<std::string>& ignore, mjModel* engine) {
  for (const DescribedConstant& constant : ListDescribedConstants()) {
    if (!Contains(ignore, constant.word)) continue;
    for (const Joint& joint : robot.joints) {
      const int id = FindByName(*engine, mjOBJ_JOINT, joint.name);
      if (id < 0) continue;
      for (int k = 0; k < CountVelocities(joint.type); ++k)
        (engine->*constant.engine)[engine->jnt_dofadr[id] + k] = joint.*constant.value;
    }
  }
}

}  // namespace dexcheck
