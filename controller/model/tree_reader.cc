#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "controller/common/text.h"
#include "controller/model/rigid_body.h"
#include "controller/model/segment_reader.h"

namespace dexcheck {
namespace {

struct Template {
  TomlValue value;
  Segment segment;
  bool used = false;
};

/// Joint that an entry follows, and the prefix of its chain's names.
struct Mimic {
  const MimicEntry* entry;
  std::string prefix;
};

/// An unbranched run of joints: its own rows, then its template's.
struct Chain {
  TomlValue value;
  TomlValue parent;
  std::string prefix;
  Pose X_PB;  ///< Where the first row starts, in the parent link's own frame.
  Segment own;
  Template* common = nullptr;

  [[nodiscard]] std::vector<Segment*> segments() {
    if (common == nullptr) return {&own};
    return {&own, &common->segment};
  }
};

template <typename Map>
std::vector<std::string> ListKeys(const Map& map) {
  std::vector<std::string> keys;
  keys.reserve(map.size());
  for (const auto& [key, value] : map) keys.push_back(key);
  return keys;
}

/// Names that must be unique, and who took them.
class NameRegistry {
 public:
  explicit NameRegistry(std::string kind) : kind_(std::move(kind)) {}

  void Reserve(const std::string& name, const std::string& owner) { owners_[name] = owner; }

  void Add(const std::string& name, const TomlValue& value) {
    const auto [entry, is_new] =
        owners_.emplace(name, value.path() + " on line " + std::to_string(value.line()));
    if (!is_new) {
      value.Reject(kind_ + " names must be unique, got " + Quote(name) + ", taken by " + entry->second);
    }
  }

 private:
  std::string kind_;
  std::map<std::string, std::string> owners_;
};

class TreeReader {
 public:
  explicit TreeReader(RobotSpec& spec) : spec_(spec) {
    link_names_.Reserve(spec.base.link, "the base");
    for (const std::string& wheel : {spec.base.wheel_joint_right, spec.base.wheel_joint_left}) {
      joint_names_.Reserve(wheel, "a wheel");
    }
  }

  std::vector<WrittenRow> Read(TomlTable& root) {
    if (const std::optional<TomlValue> templates = root.Find("template")) ReadTemplates(*templates);
    // One body that floats is a robot.
    const bool floats = spec_.base.type == BaseType::kFloating;
    for (const TomlValue& value : floats ? root.FindList("chain") : root.Get("chain").AsList())
      ReadChain(value);
    for (size_t i = 0; i < chains_.size(); ++i) BuildChain(i);
    for (const auto& [joint, mimic] : mimics_)
      spec_.joints[static_cast<size_t>(joint)].coupling = Resolve(joint, mimic);
    for (const TomlValue& value : root.FindList("frame")) BuildFrame(ReadFrameEntry(value), value, "");
    RejectUnused();
    return std::move(rows_);
  }

 private:
  void ReadTemplates(const TomlValue& value) {
    for (const auto& [name, entry] : value.AsTable().GetEntries()) {
      TomlTable table = entry.AsTable();
      templates_.emplace(name, Template{entry, ReadSegment(table)});
      table.RejectUnused();
    }
  }

  Template* FindTemplate(const TomlValue& value) {
    const std::string name = value.AsText();
    const auto found = templates_.find(name);
    if (found == templates_.end())
      value.Fail("must be a template" + SuggestInBrackets(name, ListKeys(templates_)));
    found->second.used = true;
    return &found->second;
  }

  void ReadChain(const TomlValue& value) {
    TomlTable table = value.AsTable();
    Chain chain{value, table.Get("parent"), "", Pose::Identity(), ReadSegment(table)};
    chain.prefix = table.Find("prefix", &TomlValue::AsPartName).value_or("");
    if (const std::optional<TomlValue> pose = table.Find("pose")) chain.X_PB = ReadPose(*pose);
    if (const std::optional<TomlValue> name = table.Find("template")) chain.common = FindTemplate(*name);
    table.RejectUnused();
    RegisterNames(chain);
    chains_.push_back(std::move(chain));
  }

  static void CheckCount(const TomlValue& value, const std::string& what, size_t count) {
    if (count <= kMaxJoints) return;
    value.Reject("must leave the number of " + what + " within " + std::to_string(kMaxJoints) + ", got " +
                 std::to_string(count));
  }

  void RegisterNames(Chain& chain) {
    const size_t joints_before = chain_of_link_.size();
    for (const Segment* segment : chain.segments()) {
      CheckCount(chain.value, "joints", chain_of_link_.size() + segment->rows.size());
      for (const SegmentRow& row : segment->rows) {
        joint_names_.Add(chain.prefix + row.joint, chain.value);
        link_names_.Add(chain.prefix + row.link, chain.value);
        chain_of_link_[chain.prefix + row.link] = chains_.size();
      }
    }
    if (chain_of_link_.size() == joints_before) chain.value.Reject("must have rows, its own or a template's");
  }

  /// The joint that moves a chain's parent link; it must belong to the base or to an earlier chain.
  int FindParent(size_t index) const {
    const TomlValue& parent = chains_[index].parent;
    const std::string name = parent.AsText();
    if (name == spec_.base.link) return -1;
    const auto found = chain_of_link_.find(name);
    if (found == chain_of_link_.end()) parent.Fail("must be a link" + SuggestLink(name));
    if (found->second < index) return joint_of_link_.at(name);
    const std::string cycle = DescribeCycle(index);
    if (!cycle.empty()) parent.Fail("must not be cyclic, " + cycle);
    parent.Fail("must be declared before its children, move " + Describe(found->second) + " before " +
                Describe(index));
  }

  [[nodiscard]] std::string Describe(size_t chain) const {
    const TomlValue& value = chains_[chain].value;
    return value.path() + " (line " + std::to_string(value.line()) + ")";
  }

  /// "chain[0] -> chain[1] -> chain[0]" if following the parents never reaches the base; otherwise empty.
  [[nodiscard]] std::string DescribeCycle(size_t chain) const {
    std::string text = chains_[chain].value.path();
    std::set<size_t> visited;
    while (visited.insert(chain).second) {
      const auto next = chain_of_link_.find(chains_[chain].parent.AsText());
      if (next == chain_of_link_.end()) return {};
      chain = next->second;
      text += " -> " + chains_[chain].value.path();
    }
    return Abbreviate(text);
  }

  /// Suggests a link whose name, put behind the prefix, exists.
  [[nodiscard]] std::string SuggestLink(const std::string& name, const std::string& prefix = "") const {
    std::vector<std::string> links;
    for (const auto& [link, chain] : chain_of_link_) {
      if (link.starts_with(prefix)) links.push_back(link.substr(prefix.size()));
    }
    if (prefix.empty()) links.push_back(spec_.base.link);
    return SuggestInBrackets(name, links);
  }

  void BuildChain(size_t index) {
    Chain& chain = chains_[index];
    int parent = FindParent(index);
    Pose X_LB = chain.X_PB;  // in the parent link's own frame
    for (const Segment* segment : chain.segments()) {
      for (const SegmentRow& row : segment->rows) {
        parent = BuildJoint(chain, row, parent, X_LB);
        X_LB = Pose::Identity();
      }
    }
    for (const Segment* segment : chain.segments()) {
      for (const FrameEntry& frame : segment->frames) BuildFrame(frame, chain.value, chain.prefix);
    }
  }

  /// A pose in a link's own frame as a pose in the frame of the joint that moves it; nothing is rounded where
  /// they coincide.
  [[nodiscard]] Pose FromOwnFrame(int joint, const Pose& X) const {
    if (joint < 0) return X;
    const Pose& X_iL = rows_[static_cast<size_t>(joint)].X_iL;
    return X_iL.isApprox(Pose::Identity(), 0.0) ? X : X_iL * X;
  }

  /// @param X_LB where the row starts, in the parent link's own frame.
  /// @return the joint's index.
  int BuildJoint(Chain& chain, const SegmentRow& row, int parent, const Pose& X_LB) {
    const JointEntry& entry = FindEntry(chain, &Segment::joints, "joints", row.joint, row.value);
    const LinkEntry& link = FindEntry(chain, &Segment::links, "links", row.link, row.value);
    if (row.type == JointType::kPrismatic && entry.range_is_angle) {
      entry.range.Fail("must be in m for a prismatic joint, not in degrees");
    }
    if (row.type == JointType::kBall && entry.lower != 0.0) {
      entry.range.Fail("must begin at 0 for a ball joint, whose range is of the angle of its turn");
    }
    if (row.type == JointType::kBall && entry.mimic) {
      entry.mimic->joint.Fail("must not be given for a ball joint");
    }
    const int index = static_cast<int>(spec_.joints.size());
    const bool is_plain = !row.X_before.isApprox(Pose::Identity(), 0.0);
    const bool has_own_frame = !row.written.X_iL.isApprox(Pose::Identity(), 0.0);
    spec_.joints.push_back({chain.prefix + row.joint, chain.prefix + row.link, parent, row.type,
                            FromOwnFrame(parent, is_plain ? X_LB * row.X_before : X_LB), row.mdh, entry.lower,
                            entry.upper, entry.damping.value_or(0.0), entry.armature.value_or(0.0),
                            has_own_frame ? ExpressIn(link.body, row.written.X_iL) : link.body,
                            entry.dry_friction.value_or(0.0), std::nullopt, row.written.X_iL.linear()});
    if (entry.mimic) mimics_.emplace(index, Mimic{&*entry.mimic, chain.prefix});
    rows_.push_back(row.written);
    rows_.back().states_damping = entry.damping.has_value();
    rows_.back().states_armature = entry.armature.has_value();
    rows_.back().states_dry_friction = entry.dry_friction.has_value();
    joint_of_link_[chain.prefix + row.link] = index;
    return index;
  }

  /// The joint that one follows in the end, by its chain's own names or by whole ones.
  JointCoupling Resolve(int joint, const Mimic& first) const {
    JointCoupling coupling;
    std::set<int> seen = {joint};
    for (const Mimic* at = &first; at != nullptr;) {
      const MimicEntry& entry = *at->entry;
      const std::string name = entry.joint.AsPartName();
      coupling.leader = FindJoint(at->prefix + name);
      if (coupling.leader < 0) coupling.leader = FindJoint(name);
      if (coupling.leader < 0) {
        std::vector<std::string> names;
        for (const Joint& other : spec_.joints) names.push_back(other.name);
        entry.joint.Fail("must be a joint" + SuggestInBrackets(name, names));
      }
      if (!seen.insert(coupling.leader).second) entry.joint.Fail("must not follow itself");
      coupling.offset += coupling.multiplier * entry.offset;
      coupling.multiplier *= entry.multiplier;
      const auto next = mimics_.find(coupling.leader);
      at = next == mimics_.end() ? nullptr : &next->second;
    }
    return coupling;
  }

  [[nodiscard]] int FindJoint(const std::string& name) const {
    for (size_t i = 0; i < spec_.joints.size(); ++i) {
      if (spec_.joints[i].name == name) return static_cast<int>(i);
    }
    return -1;
  }

  /// The chain's own entry of that name, or else its template's.
  template <typename Entry>
  const Entry& FindEntry(Chain& chain, std::map<std::string, Entry> Segment::*entries,
                         const std::string& kind, const std::string& name, const TomlValue& row) {
    const Entry* found = nullptr;
    for (Segment* segment : chain.segments()) {
      const auto entry = (segment->*entries).find(name);
      if (entry != (segment->*entries).end()) {
        entry->second.used = true;
        if (found == nullptr) found = &entry->second;
      }
    }
    if (found != nullptr) return *found;
    std::vector<std::string> names;
    for (Segment* segment : chain.segments()) {
      for (const std::string& key : ListKeys(segment->*entries)) names.push_back(key);
    }
    row.Reject("has no entry in " + kind + SuggestInBrackets(name, names) + ", got " + Quote(name));
  }

  void BuildFrame(const FrameEntry& frame, const TomlValue& owner, const std::string& prefix) {
    const std::string name = prefix + frame.name.AsPartName();
    const std::string own_link = frame.link.AsText();
    const std::string link = prefix + own_link;
    frame_names_.Add(name, owner);
    CheckCount(owner, "frames", spec_.frames.size() + 1);
    int joint = -1;
    if (link != spec_.base.link) {
      const auto found = joint_of_link_.find(link);
      if (found == joint_of_link_.end()) frame.link.Fail("must be a link" + SuggestLink(own_link, prefix));
      joint = found->second;
    }
    spec_.frames.push_back({name, joint, FromOwnFrame(joint, frame.X_LF), frame.sphere_radius});
  }

  void RejectUnused() const {
    for (const Chain& chain : chains_) RejectUnused(chain.own);
    for (const auto& [name, common] : templates_) {
      if (!common.used) common.value.Reject("must be used by a chain");
      RejectUnused(common.segment);
    }
  }

  static void RejectUnused(const Segment& segment) {
    for (const auto& [name, entry] : segment.joints) {
      if (!entry.used) entry.value.Reject("no row has this joint");
    }
    for (const auto& [name, entry] : segment.links) {
      if (!entry.used) entry.value.Reject("no row has this link");
    }
  }

  RobotSpec& spec_;
  std::map<int, Mimic> mimics_;  // by joint
  std::vector<WrittenRow> rows_;
  std::map<std::string, Template> templates_;
  std::vector<Chain> chains_;
  NameRegistry joint_names_{"joint"};
  NameRegistry link_names_{"link"};
  NameRegistry frame_names_{"frame"};
  std::map<std::string, size_t> chain_of_link_;
  std::map<std::string, int> joint_of_link_;
};

}  // namespace

std::vector<WrittenRow> ReadTree(TomlTable& root, RobotSpec& spec) { return TreeReader(spec).Read(root); }

}  // namespace dexcheck
