#include "harness/comparison/engine_contacts.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "controller/common/text.h"
#include "harness/base/worst.h"
#include "harness/engine/engine.h"
#include "harness/engine/exact_collision.h"
#include "harness/engine/map_vector.h"
#include "harness/engine/mujoco_release.h"

namespace dexcheck {
namespace {

/// Hard fingers and wheels (20): a normal force and friction along the surface.
constexpr int kHardContact = 3;

std::string List(const mjtNum* values, int count) {
  return fmt::format("{:.17g}", fmt::join(values, values + count, " "));
}

class ContactReader {
 public:
  ContactReader(const Adapter& adapter, EngineParts* list)
      : adapter_(adapter), engine_(adapter.engine()), list_(*list) {}

  void Run() {
    AddPairs();
    if (!adapter_.wheels().empty()) AddFloor();
    NoteContactsByType();
    NoteSettings();
  }

 private:
  void Note(const std::string& kind, std::string text) { list_.notes.push_back({kind, std::move(text)}); }

  [[nodiscard]] std::string GeomName(int geom) const { return "geom " + NameOf(engine_, mjOBJ_GEOM, geom); }

  [[nodiscard]] bool IsObject(int geom) const {
    return adapter_.object_body() >= 0 && engine_.geom_bodyid[geom] == adapter_.object_body();
  }
  [[nodiscard]] bool IsWorld(int geom) const { return engine_.body_weldid[engine_.geom_bodyid[geom]] == 0; }
  [[nodiscard]] bool IsWheel(int geom) const {
    return std::ranges::any_of(adapter_.wheels(), [&](const EngineWheel& wheel) {
      return engine_.geom_bodyid[geom] == engine_.jnt_bodyid[wheel.joint];
    });
  }
  [[nodiscard]] bool IsFingertip(int geom) const {
    const auto& tips = adapter_.model().fingertips();
    return std::ranges::any_of(tips, [&](int frame) {
      return engine_.site_bodyid[adapter_.frame_sites()[static_cast<size_t>(frame)]] ==
             engine_.geom_bodyid[geom];
    });
  }

  /// Returns whether a floating robot may stand on a shape: the model has a frame on its body.
  [[nodiscard]] bool IsFoot(int geom) const {
    const std::vector<int>& sites = adapter_.frame_sites();
    return adapter_.model().base().type == BaseType::kFloating && std::ranges::any_of(sites, [&](int site) {
             return site >= 0 && engine_.site_bodyid[site] == engine_.geom_bodyid[geom];
           });
  }

  [[nodiscard]] std::string DescribeGeom(int geom) const {
    return fmt::format("{} (type {}, size {}, pos {}, quat {})", GeomName(geom), engine_.geom_type[geom],
                       List(engine_.geom_size + 3 * geom, 3), List(engine_.geom_pos + 3 * geom, 3),
                       List(engine_.geom_quat + 4 * geom, 4));
  }

  /// Explicit contact pairs: nothing acts at a distance, fingers and wheels are hard, and all else of the
  /// robot but feet that touches the world slides without friction.
  void AddPairs() {
    std::set<int> meshes;
    for (int pair = 0; pair < engine_.npair; ++pair) {
      const std::string where = "pair " + NameOf(engine_, mjOBJ_PAIR, pair);
      EnginePart& part = list_.parts.emplace_back(EnginePart{where, where, where});
      const int geoms[2] = {engine_.pair_geom1[pair], engine_.pair_geom2[pair]};
      const mjtNum* const friction = engine_.pair_friction + 5 * pair;
      const int dim = engine_.pair_dim[pair];
      part.numbers = {{"contact_margin", "margin", engine_.pair_margin[pair], 0.0},
                      {"contact_margin", "gap", engine_.pair_gap[pair], 0.0}};
      for (int k = 0; k < 2; ++k) {
        const int own = geoms[k];
        const int other = geoms[1 - k];
        if (engine_.geom_type[own] == mjGEOM_MESH || engine_.geom_type[own] == mjGEOM_HFIELD)
          meshes.insert(own);
        const bool hard = (IsFingertip(own) && IsObject(other)) || (IsWheel(own) && IsWorld(other));
        if (hard)
          part.numbers.push_back({"contact_dimension", "dimension", static_cast<double>(dim), kHardContact});
        const bool has_friction = IsWorld(other) && !IsWorld(own) && !IsObject(own) && !IsWheel(own) &&
                                  !IsFingertip(own) && !IsFoot(own);
        if (has_friction)
          part.numbers.push_back(
              {"contact_rubbing", "friction", dim > 1 ? Worst(friction[0], friction[1]) : 0.0, 0.0});
      }
      Note("contact_pair",
           fmt::format("{}: {} and {}: dimension {}, friction {}, margin {:.17g}, gap {:.17g}", where,
                       DescribeGeom(geoms[0]), DescribeGeom(geoms[1]), dim, List(friction, 5),
                       engine_.pair_margin[pair], engine_.pair_gap[pair]));
    }
    for (const int geom : meshes) NoteMesh(geom);
  }

  /// The engine collides a mesh as its convex hull.
  void NoteMesh(int geom) {
    const int id = engine_.geom_dataid[geom];
    double sum = 0.0;
    if (engine_.geom_type[geom] == mjGEOM_MESH) {
      const float* const first = engine_.mesh_vert + 3 * engine_.mesh_vertadr[id];
      for (int k = 0; k < 3 * engine_.mesh_vertnum[id]; ++k) sum += std::abs(static_cast<double>(first[k]));
    } else {
      const float* const first = engine_.hfield_data + engine_.hfield_adr[id];
      for (int k = 0; k < engine_.hfield_nrow[id] * engine_.hfield_ncol[id]; ++k)
        sum += std::abs(static_cast<double>(first[k]));
      for (int k = 0; k < 4; ++k) sum += engine_.hfield_size[4 * id + k];
    }
    Note("mesh_contacts",
         fmt::format("{}: touches with its mesh's hull or height field{}; its coordinates add up to {:.17g}",
                     GeomName(geom), IsTorus(geom) ? ", spheres and boxes with the exact torus" : "", sum));
  }

  [[nodiscard]] bool IsTorus(int geom) const {
    double ring_radius = 0.0;
    double tube_radius = 0.0;
    return GetTorusRadii(engine_, geom, &ring_radius, &tube_radius);
  }

  /// The wheels are round about the axle and stand on a level floor.
  void AddFloor() {
    const MjDataPtr data = MakeDataWithoutContacts(engine_);
    mj_kinematics(&engine_, data.get());
    const auto place = [&](int geom) {
      return MapPose(data->geom_xmat + 9 * geom, data->geom_xpos + 3 * geom);
    };
    const auto add = [&](const char* check, int geom, double expected, double value, double tolerance) {
      EnginePart& part = list_.parts.emplace_back(EnginePart{"shape " + GeomName(geom), "", GeomName(geom)});
      part.numbers = {{check, GeomName(geom), value, expected, tolerance}};
    };
    for (const EngineWheel& wheel : adapter_.wheels()) {
      const Vector3d center = adapter_.model().base().X_B0 * wheel.center;
      const double tolerance = kConstantRounding * Worst(1.0, center.norm());
      for (int geom = 0; geom < engine_.ngeom; ++geom) {
        if (engine_.geom_bodyid[geom] != engine_.jnt_bodyid[wheel.joint] || !Touches(geom)) continue;
        add("wheel_geom_place", geom, 0.0, (place(geom).translation() - center).norm(), tolerance);
        if (engine_.geom_type[geom] != mjGEOM_SPHERE)
          add("wheel_geom_place", geom, 1.0, std::abs(place(geom).linear().col(2).dot(wheel.axis)),
              tolerance);
        for (const int floor : ListPartners(geom)) {
          if (engine_.geom_type[floor] != mjGEOM_PLANE) continue;
          const Vector3d normal = place(floor).linear().col(2);
          add("floor_pose", floor, 1.0, normal.z(), tolerance);
          add("floor_pose", floor, 0.0, normal.head<2>().norm(), tolerance);
          add("floor_pose", floor, center.z() - wheel.radius, place(floor).translation().z(), tolerance);
        }
      }
    }
  }

  /// Whether a geom takes part in contacts as the option "collision" has it.
  [[nodiscard]] bool Touches(int geom) const {
    const bool by_type = engine_.geom_contype[geom] != 0 || engine_.geom_conaffinity[geom] != 0;
    return (!ListPartners(geom).empty() && CollidesByPair(engine_)) || (by_type && CollidesByType(engine_));
  }

  /// Geoms that a geom has a contact pair with.
  [[nodiscard]] std::set<int> ListPartners(int geom) const {
    std::set<int> partners;
    for (int pair = 0; pair < engine_.npair; ++pair) {
      const int one = engine_.pair_geom1[pair], other = engine_.pair_geom2[pair];
      if (one == geom) partners.insert(other);
      if (other == geom) partners.insert(one);
    }
    return partners;
  }

  void NoteContactsByType() {
    if (!CollidesByType(engine_)) return;
    Note("contacts_by_type",
         fmt::format("option collision {}: geoms touch by contype and conaffinity, but {} pairs of bodies",
                     GetCollisionOption(engine_), engine_.nexclude));
    for (int geom = 0; geom < engine_.ngeom; ++geom) {
      if (engine_.geom_contype[geom] == 0 && engine_.geom_conaffinity[geom] == 0) continue;
      Note("contacts_by_type",
           fmt::format("{}: contype {}, conaffinity {}, condim {}, priority {}, friction {}, margin {:.17g}, "
                       "gap {:.17g}, solmix {:.17g}, solref {}, solimp {}",
                       DescribeGeom(geom), engine_.geom_contype[geom], engine_.geom_conaffinity[geom],
                       engine_.geom_condim[geom], engine_.geom_priority[geom],
                       List(engine_.geom_friction + 3 * geom, 3), engine_.geom_margin[geom],
                       engine_.geom_gap[geom], engine_.geom_solmix[geom],
                       List(engine_.geom_solref + mjNREF * geom, mjNREF),
                       List(engine_.geom_solimp + mjNIMP * geom, mjNIMP)));
    }
    for (int i = 0; i < engine_.nexclude; ++i) {
      const auto [body1, body2] = ReadSignature(engine_.exclude_signature[i]);
      Note("contacts_by_type", fmt::format("excluded: {} and {}", NameOf(engine_, mjOBJ_BODY, body1),
                                           NameOf(engine_, mjOBJ_BODY, body2)));
    }
  }

  void NoteSettings() {
    const mjOption& option = engine_.opt;
    Note("overridden",
         fmt::format("a run sets the time step ({:.17g} s here), impratio ({:.17g}), noslip iterations ({}) "
                     "and the stiffness of all contact pairs; joint damping acts as an explicit force",
                     option.timestep, option.impratio, option.noslip_iterations));
    Note("solver",
         fmt::format(
             "integrator {}, cone {}, jacobian {}, solver {}, iterations {}, tolerance {:.17g}, noslip "
             "tolerance {:.17g}, mpr iterations {}, mpr tolerance {:.17g}, mean inertia {:.17g}",
             option.integrator, option.cone, option.jacobian, option.solver, option.iterations,
             option.tolerance, option.noslip_tolerance, GetColliderIterations(option),
             GetColliderTolerance(option), engine_.stat.meaninertia));
  }

  const Adapter& adapter_;
  const mjModel& engine_;
  EngineParts& list_;
};

/// An option that acts on no term at a given state.
struct EngineOption {
  const char* name;
  std::vector<double> (*read)(const mjOption& option);
  std::vector<const char*> words = {};  // of the values 0, 1, ...
};

template <auto kMember, int kCount = 1>
std::vector<double> ReadOption(const mjOption& option) {
  if constexpr (kCount == 1) {
    return {static_cast<double>(option.*kMember)};
  } else {
    return {option.*kMember, option.*kMember + kCount};
  }
}

const std::vector<EngineOption> kOptions = {
    {"timestep", ReadOption<&mjOption::timestep>},
    {"integrator", ReadOption<&mjOption::integrator>, {"Euler", "RK4", "implicit", "implicitfast"}},
    {"cone", ReadOption<&mjOption::cone>, {"pyramidal", "elliptic"}},
    {"impratio", ReadOption<&mjOption::impratio>},
    {"solver", ReadOption<&mjOption::solver>, {"PGS", "CG", "Newton"}},
    {"jacobian", ReadOption<&mjOption::jacobian>, {"dense", "sparse", "auto"}},
    {"iterations", ReadOption<&mjOption::iterations>},
    {"tolerance", ReadOption<&mjOption::tolerance>},
    {"noslip_iterations", ReadOption<&mjOption::noslip_iterations>},
    {"noslip_tolerance", ReadOption<&mjOption::noslip_tolerance>},
    {"iterations of the collider",
     [](const mjOption& option) {
       return std::vector<double>{static_cast<double>(GetColliderIterations(option))};
     }},
    {"tolerance of the collider",
     [](const mjOption& option) { return std::vector<double>{GetColliderTolerance(option)}; }},
    {"wind", ReadOption<&mjOption::wind, 3>},
    {"magnetic", ReadOption<&mjOption::magnetic, 3>},
    {"o_margin", ReadOption<&mjOption::o_margin>},
    {"o_solref", ReadOption<&mjOption::o_solref, mjNREF>},
    {"o_solimp", ReadOption<&mjOption::o_solimp, mjNIMP>}};

std::string Show(const EngineOption& option, const std::vector<double>& values) {
  const auto word = static_cast<size_t>(values.front());
  if (values.size() == 1 && word < option.words.size()) return option.words[word];
  return fmt::format("{:g}", fmt::join(values, " "));
}

/// Elements of one kind whose numbers act on constraints, sensors or starts of runs alone.
struct RunElements {
  const char* words;
  mjtObj type;
  bool lists_missing;  ///< Whether an element that one of two models lacks is a difference.
  /// The numbers of one element; empty where they have no effect.
  std::string (*show)(const mjModel& model, int index);
};

/// Six digits, since the engine saves no more.
std::string ShowShort(const mjtNum* values, int count) {
  return fmt::format("{:.6g} ", fmt::join(values, values + count, " "));
}

std::string ShowSoftness(const mjtNum* solref, const mjtNum* solimp, int index) {
  return ShowShort(solref + mjNREF * index, mjNREF) + ShowShort(solimp + mjNIMP * index, mjNIMP);
}

const RunElements kRunElements[] = {
    {"softness of limits", mjOBJ_JOINT, false,
     [](const mjModel& m, int i) {
       return m.jnt_limited[i] == 0 ? "" : ShowSoftness(m.jnt_solref, m.jnt_solimp, i);
     }},
    {"softness of dry friction", mjOBJ_JOINT, false,
     [](const mjModel& m, int i) {
       const int dof = m.jnt_dofadr[i];
       return m.dof_frictionloss[dof] == 0.0 ? "" : ShowSoftness(m.dof_solref, m.dof_solimp, dof);
     }},
    {"softness of tendons", mjOBJ_TENDON, false,
     [](const mjModel& m, int i) {
       return (m.tendon_limited[i] == 0 ? "" : ShowSoftness(m.tendon_solref_lim, m.tendon_solimp_lim, i)) +
              (m.tendon_frictionloss[i] == 0.0 ? ""
                                               : ShowSoftness(m.tendon_solref_fri, m.tendon_solimp_fri, i));
     }},
    {"softness of equalities", mjOBJ_EQUALITY, false,
     [](const mjModel& m, int i) { return ShowSoftness(m.eq_solref, m.eq_solimp, i); }},
    {"sensors", mjOBJ_SENSOR, true,
     [](const mjModel& m, int i) {
       const auto object = static_cast<mjtObj>(m.sensor_objtype[i]);
       return fmt::format("{} {} {} {} {}", m.sensor_type[i],
                          object == mjOBJ_UNKNOWN ? "" : NameOf(m, object, m.sensor_objid[i]),
                          m.sensor_dim[i], m.sensor_cutoff[i], m.sensor_noise[i]);
     }},
    {"keyframes", mjOBJ_KEY, true, [](const mjModel& m, int i) {
       return ShowShort(m.key_qpos + m.nq * i, static_cast<int>(m.nq)) +
              ShowShort(m.key_qvel + m.nv * i, static_cast<int>(m.nv)) +
              ShowShort(m.key_ctrl + m.nu * i, static_cast<int>(m.nu));
     }}};

std::map<std::string, std::string> ListRunElements(const RunElements& kind, const mjModel& model) {
  std::map<std::string, std::string> texts;
  for (int i = 0; i < CountElements(model, kind.type); ++i)
    texts[NameOf(model, kind.type, i)] = kind.show(model, i);
  return texts;
}

}  // namespace

void AddContacts(const Adapter& adapter, EngineParts* list) { ContactReader(adapter, list).Run(); }

std::vector<std::string> CompareContacts(const std::vector<ConstantNote>& first,
                                         const std::vector<ConstantNote>& second) {
  std::vector<std::string> lines;
  for (const auto& [kind, word] : {std::pair("contacts_by_type", "contacts by contype and conaffinity"),
                                   {"contact_pair", "contact pairs"},
                                   {"mesh_contacts", "meshes that touch"}}) {
    std::map<std::string, std::string> texts[2];
    for (const size_t side : {0U, 1U}) {
      for (const ConstantNote& note : side == 0 ? first : second) {
        const size_t end = std::min(note.text.find(" ("), note.text.find(": "));
        if (note.kind == kind) texts[side][note.text.substr(0, end)] += note.text;
      }
    }
    std::vector<std::string> differing;
    for (const size_t side : {0U, 1U}) {
      for (const auto& [name, text] : texts[side]) {
        const auto other = texts[1 - side].find(name);
        const bool is_missing = other == texts[1 - side].end();
        if (is_missing || (side == 0 && other->second != text)) differing.push_back(name);
      }
    }
    if (!differing.empty())
      lines.push_back(std::string(word) + ": shapes, places, friction or parameters differ at " +
                      Abbreviate(JoinNames(differing)));
  }
  return lines;
}

std::vector<std::string> CompareOptions(const mjOption& first, const mjOption& second,
                                        const std::string& first_file, const std::string& second_file) {
  std::vector<std::string> lines;
  for (const EngineOption& option : kOptions) {
    const auto own = option.read(first), other = option.read(second);
    if (own != other)
      lines.push_back(fmt::format("option {}: {} in {}, {} in {}", option.name, Show(option, own), first_file,
                                  Show(option, other), second_file));
  }
  return lines;
}

std::vector<std::string> CompareRunElements(const mjModel& first, const mjModel& second) {
  std::vector<std::string> lines;
  for (const RunElements& kind : kRunElements) {
    const auto own = ListRunElements(kind, first), others = ListRunElements(kind, second);
    std::vector<std::string> differing;
    for (const auto& [name, text] : own) {
      const auto other = others.find(name);
      if (other == others.end() ? kind.lists_missing : other->second != text) differing.push_back(name);
    }
    for (const auto& [name, text] : others)
      if (kind.lists_missing && !own.contains(name)) differing.push_back(name);
    if (!differing.empty())
      lines.push_back(std::string(kind.words) + ": " + Abbreviate(JoinNames(differing)));
  }
  return lines;
}

}  // namespace dexcheck
