#pragma once

// A quadruped and a humanoid whose pelvis or trunk floats, each written as a URDF and as an MJCF.

#include <string>
#include <vector>

namespace dexcheck::testing {

/// A link and the joint that moves it; numbers as they stand in the files.
struct LeggedLink {
  std::string name;
  std::string parent;  ///< Empty for the one that floats.
  std::string xyz;     ///< Position of the joint in the parent's frame, m.
  std::string rpy;     ///< Its rotation, rad.
  std::string axis;
  double mass;  ///< kg
  std::string com;
  std::string com_rpy;    ///< Rotation of the principal axes.
  std::string moments;    ///< Principal, kg m^2.
  bool has_joint = true;  ///< Otherwise it is welded to the parent.
};

/// Trunk, four legs of three joints, feet that are welded to the shanks: 12 joints.
std::vector<LeggedLink> ListQuadruped();
/// Pelvis, two legs of six joints, waist of three, two arms of seven, head of two: 31 joints.
std::vector<LeggedLink> ListHumanoid();

std::string WriteLeggedUrdf(const std::string& name, const std::vector<LeggedLink>& links);
/// @param base_joint what moves the first body.
std::string WriteLeggedMjcf(const std::string& name, const std::vector<LeggedLink>& links,
                            const std::string& base_joint = "<freejoint/>");

}  // namespace dexcheck::testing
