#include "harness/sides/description_match.h"

#include <algorithm>
#include <functional>
#include <map>

#include "controller/common/errors.h"
#include "controller/common/text.h"
#include "harness/sides/alike_names.h"
#include "harness/sides/join_names.h"

namespace dexcheck {
namespace {

/// What each of the two takes from the other.
class Matching {
 public:
  Matching(RobotDescription* a, RobotDescription* b)
      : a_(*a), b_(*b), b_of_a_(MatchJoints(a_.spec, b_.spec)), a_of_b_(MatchJoints(b_.spec, a_.spec)) {}

  std::vector<std::string> Run() {
    TakeBase();
    RequireSameMechanism();
    TakeGravity();
    TakeNames();
    TakeConstants();
    DropFrames();
    return notes_;
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
      notes_.push_back("base: " + robot->spec.source +
                       " does not say how its root moves; it floats as that of " + other.spec.source);
    };
    take(&a_, b_);
    take(&b_, a_);
    if (a_.spec.base.type != BaseType::kFloating || b_.spec.base.type != BaseType::kFloating) return;
    if (!MoveBaseTo(a_.spec.base.link, &b_)) MoveBaseTo(b_.spec.base.link, &a_);
  }

  void TakeGravity() {
    if (a_.states_gravity == b_.states_gravity) return;
    (a_.states_gravity ? b_ : a_).spec.gravity = (a_.states_gravity ? a_ : b_).spec.gravity;
    notes_.push_back("gravity: only " + (a_.states_gravity ? a_ : b_).spec.source + " states it, " +
                     FormatNumbers(a_.spec.gravity));
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
    if (!renamed.empty()) notes_.push_back("links by other names: " + JoinNames(renamed));
  }

  void TakeConstants() {
    Take("armature", &DescribedJoint::states_armature, [](RobotDescription& robot, size_t i) {
      return std::vector<double*>{&robot.spec.joints[i].armature};
    });
    Take("damping", &DescribedJoint::states_damping, [](RobotDescription& robot, size_t i) {
      return std::vector<double*>{&robot.spec.joints[i].damping};
    });
    Take("dry friction", &DescribedJoint::states_dry_friction, [](RobotDescription& robot, size_t i) {
      return std::vector<double*>{&robot.spec.joints[i].dry_friction};
    });
    Take("range", &DescribedJoint::states_range, [](RobotDescription& robot, size_t i) {
      return std::vector<double*>{&robot.spec.joints[i].lower, &robot.spec.joints[i].upper};
    });
  }

  void Take(const std::string& what, bool DescribedJoint::*states,
            const std::function<std::vector<double*>(RobotDescription&, size_t)>& numbers) {
    std::map<std::string, std::vector<std::string>> taken;  // by the source that states it
    for (size_t i = 0; i < b_of_a_.size(); ++i) {
      const auto j = static_cast<size_t>(b_of_a_[i]);
      const bool in_a = a_.joints[i].*states;
      const bool in_b = b_.joints[j].*states;
      if (in_a == in_b) continue;
      const std::vector<double*> own = numbers(a_, i);
      const std::vector<double*> other = numbers(b_, j);
      bool differs = false;
      for (size_t k = 0; k < own.size(); ++k) {
        differs = differs || *own[k] != *other[k];
        *(in_a ? other[k] : own[k]) = *(in_a ? own[k] : other[k]);
      }
      if (differs) taken[(in_a ? a_ : b_).spec.source].push_back(a_.spec.joints[i].name);
    }
    for (const auto& [source, names] : taken) {
      notes_.push_back(what + ": only " + source + " states it, for " + JoinNames(names));
    }
  }

  void DropFrames() {
    const auto drop = [this](RobotDescription* robot, const RobotDescription& other) {
      std::vector<std::string> dropped;
      std::erase_if(robot->spec.frames, [&](const Frame& frame) {
        const bool lacks = std::none_of(other.spec.frames.begin(), other.spec.frames.end(),
                                        [&](const Frame& candidate) { return candidate.name == frame.name; });
        if (lacks) dropped.push_back(frame.name);
        return lacks;
      });
      if (!dropped.empty())
        notes_.push_back("frames only in " + robot->spec.source + ": " + JoinNames(dropped));
    };
    drop(&a_, b_);
    drop(&b_, a_);
  }

  RobotDescription& a_;
  RobotDescription& b_;
  std::vector<int> b_of_a_;
  std::vector<int> a_of_b_;
  std::vector<std::string> notes_;
};

}  // namespace

std::vector<int> MatchJoints(const RobotSpec& a, const RobotSpec& b) {
  std::map<std::string, int> index_of;
  for (const Joint& joint : b.joints) index_of.emplace(joint.name, static_cast<int>(index_of.size()));
  std::vector<int> match;
  for (const Joint& joint : a.joints) {
    const auto found = index_of.find(joint.name);
    match.push_back(found == index_of.end() ? -1 : found->second);
  }
  return match;
}

std::vector<std::string> CompleteEachOther(RobotDescription* a, RobotDescription* b) {
  std::vector<std::string> names;
  for (const Joint& joint : a->spec.joints) names.push_back(joint.name);
  std::vector<std::string> notes = TakeJointNames(names, a->spec.source, b);
  const std::vector<std::string> others = Matching(a, b).Run();
  notes.insert(notes.end(), others.begin(), others.end());
  return notes;
}

}  // namespace dexcheck
