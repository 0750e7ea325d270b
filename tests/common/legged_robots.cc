#include "tests/common/legged_robots.h"

#include <fmt/format.h>

#include <sstream>

namespace dexcheck::testing {
namespace {

/// The other side's place: y changes its sign.
std::string Mirror(const std::string& xyz) {
  std::istringstream in(xyz);
  std::string x, y, z;
  in >> x >> y >> z;
  return x + " " + (y.starts_with("-") ? y.substr(1) : y == "0" ? y : "-" + y) + " " + z;
}

/// Mirrors roll, pitch and yaw.
std::string MirrorTurn(const std::string& rpy) {
  std::istringstream in(rpy);
  std::string numbers[3];
  in >> numbers[0] >> numbers[1] >> numbers[2];
  for (const int k : {0, 2}) {
    std::string& x = numbers[k];
    x = x.starts_with("-") ? x.substr(1) : x == "0" ? x : "-" + x;
  }
  return numbers[0] + " " + numbers[1] + " " + numbers[2];
}

/// Mirrors the turns of all links whose names have one of these prefixes.
void MirrorTurns(const std::vector<std::string>& prefixes, std::vector<LeggedLink>* links) {
  for (LeggedLink& link : *links) {
    for (const std::string& prefix : prefixes) {
      if (!link.name.starts_with(prefix)) continue;
      link.rpy = MirrorTurn(link.rpy);
      link.com_rpy = MirrorTurn(link.com_rpy);
    }
  }
}

/// @param child_of what hangs on a body, written into it.
void WriteMjcfBody(const std::vector<LeggedLink>& links, const LeggedLink& link,
                   const std::string& base_joint, std::string* text) {
  *text += fmt::format("<body name=\"{}\" pos=\"{}\" euler=\"{}\">\n", link.name, link.xyz, link.rpy);
  if (link.parent.empty()) {
    *text += base_joint + "\n";
  } else if (link.has_joint) {
    *text += fmt::format(
        "<joint name=\"{}_joint\" axis=\"{}\" limited=\"true\" range=\"-1.5 1.5\" damping=\"0.25\"/>\n",
        link.name, link.axis);
  }
  *text += fmt::format("<inertial mass=\"{}\" pos=\"{}\" euler=\"{}\" diaginertia=\"{}\"/>\n", link.mass,
                       link.com, link.com_rpy, link.moments);
  *text += fmt::format("<site name=\"{}_mark\" pos=\"0.01 0.02 0.03\"/>\n", link.name);
  for (const LeggedLink& child : links) {
    if (child.parent == link.name) WriteMjcfBody(links, child, base_joint, text);
  }
  *text += "</body>\n";
}

}  // namespace

std::vector<LeggedLink> ListQuadruped() {
  std::vector<LeggedLink> links = {{"trunk", "", "0 0 0.3", "0 0 0", "", 6.9, "0.012 0.002 0.0005",
                                    "0.1 -0.2 0.05", "0.0248 0.0984 0.1073"}};
  for (const std::string leg : {"FL", "FR", "RL", "RR"}) {
    const bool front = leg[0] == 'F';
    const bool right = leg[1] == 'R';
    const auto side = [right](const std::string& xyz) { return right ? Mirror(xyz) : xyz; };
    links.push_back({leg + "_hip", "trunk", side(front ? "0.1934 0.0465 0" : "-0.1934 0.0465 0"), "0 0 0",
                     "1 0 0", 0.678, side("-0.005 0.002 0.0001"), "0.3 0 0.2", "0.00048 0.00088 0.0006"});
    links.push_back({leg + "_thigh", leg + "_hip", side("0 0.0955 0"), "0 0 0", "0 1 0", 1.152,
                     side("-0.0037 -0.0193 -0.0348"), "0 0.4 0", "0.00584 0.0058 0.00103"});
    links.push_back({leg + "_calf", leg + "_thigh", "0 0 -0.213", "0 0.1 0", "0 1 0", 0.154,
                     "0.0047 0 -0.1318", "0 0 0.7", "0.00108 0.0011 0.000033"});
    links.push_back({leg + "_foot", leg + "_calf", "0 0 -0.213", "0.2 0 0", "", 0.06, "0.001 0 0", "0 0 0",
                     "0.0000096 0.0000096 0.0000096", false});
  }
  MirrorTurns({"FR_", "RR_"}, &links);
  return links;
}

std::vector<LeggedLink> ListHumanoid() {
  std::vector<LeggedLink> links = {
      {"pelvis", "", "0 0 0.9", "0 0 0", "", 10.5, "0 0 0.07", "0 0.1 0", "0.098 0.078 0.09"},
      {"waist_yaw", "pelvis", "0 0 0.1", "0 0 0", "0 0 1", 1.2, "0 0 0.03", "0 0 0", "0.004 0.004 0.003"},
      {"waist_roll", "waist_yaw", "0 0 0.05", "0 0 0", "1 0 0", 0.9, "0.01 0 0.02", "0.2 0 0",
       "0.003 0.002 0.003"},
      {"torso", "waist_roll", "0 0 0.05", "0 0 0", "0 1 0", 18.4, "0.02 0.001 0.2", "0.05 0.1 0.15",
       "0.45 0.38 0.2"},
      {"neck", "torso", "0.01 0 0.42", "0 0.1 0", "0 0 1", 0.6, "0 0 0.02", "0 0 0", "0.0006 0.0006 0.0004"},
      {"head", "neck", "0 0 0.06", "0 0 0", "0 1 0", 3.1, "0.03 0 0.08", "0 0.2 0", "0.017 0.018 0.012"}};
  for (const std::string name : {"left", "right"}) {
    const bool right = name == "right";
    const auto side = [right](const std::string& xyz) { return right ? Mirror(xyz) : xyz; };
    const std::string p = name + "_";
    const std::vector<LeggedLink> limb = {
        {p + "hip_yaw", "pelvis", side("0 0.09 -0.05"), "0 0 0", "0 0 1", 1.4, side("0 0.01 -0.03"),
         "0 0 0.1", "0.0031 0.0029 0.002"},
        {p + "hip_roll", p + "hip_yaw", "0 0 -0.06", "0 0 0", "1 0 0", 1.6, side("0.01 0.005 0"), "0 0 0",
         "0.0035 0.004 0.0033"},
        {p + "thigh", p + "hip_roll", "0 0 0", "0 0 0", "0 1 0", 6.2, side("0.01 0.004 -0.17"), "0.05 0 0",
         "0.11 0.112 0.016"},
        {p + "shank", p + "thigh", "0 0 -0.38", "0 0.05 0", "0 1 0", 3.4, side("0.005 0.002 -0.15"),
         "0 0.03 0", "0.048 0.049 0.004"},
        {p + "ankle", p + "shank", "0 0 -0.37", "0 -0.05 0", "0 1 0", 0.4, "0 0 0", "0 0 0",
         "0.0003 0.0003 0.0003"},
        {p + "foot", p + "ankle", "0 0 0", "0 0 0", "1 0 0", 1.1, side("0.03 0.001 -0.04"), "0 0.1 0",
         "0.0012 0.0052 0.0056"},
        {p + "shoulder_pitch", "torso", side("0 0.16 0.36"), "0.1 0 0", "0 1 0", 0.9, side("0 0.03 0"),
         "0 0 0", "0.0011 0.0009 0.0012"},
        {p + "shoulder_roll", p + "shoulder_pitch", side("0 0.05 0"), "0 0 0", "1 0 0", 0.8, "0 0 -0.02",
         "0 0 0.3", "0.001 0.0011 0.0008"},
        {p + "upper_arm", p + "shoulder_roll", "0 0 -0.05", "0 0 0", "0 0 1", 2.1, side("0 0.002 -0.1"),
         "0.02 0 0", "0.016 0.0162 0.0021"},
        {p + "elbow", p + "upper_arm", "0.01 0 -0.22", "0 0 0", "0 1 0", 0.7, "0 0 -0.01", "0 0 0",
         "0.0008 0.0009 0.0007"},
        {p + "forearm", p + "elbow", "-0.01 0 -0.05", "0 0 0", "0 0 1", 1.2, "0 0 -0.09", "0 0.04 0",
         "0.0071 0.0072 0.0009"},
        {p + "wrist", p + "forearm", "0 0 -0.2", "0 0 0", "1 0 0", 0.2, "0 0 0", "0 0 0",
         "0.0001 0.0001 0.0001"},
        {p + "hand", p + "wrist", "0 0 0", "0 0 0", "0 1 0", 0.5, side("0.01 0.003 -0.07"), "0 0 0.2",
         "0.0009 0.001 0.0004"}};
    links.insert(links.end(), limb.begin(), limb.end());
  }
  MirrorTurns({"right_"}, &links);
  return links;
}

std::string WriteLeggedUrdf(const std::string& name, const std::vector<LeggedLink>& links) {
  std::string text = fmt::format("<robot name=\"{}\">\n", name);
  for (const LeggedLink& link : links) {
    std::istringstream moments(link.moments);
    std::string ixx, iyy, izz;
    moments >> ixx >> iyy >> izz;
    text += fmt::format(
        R"(<link name="{}"><inertial><origin xyz="{}" rpy="{}"/><mass value="{}"/><inertia ixx="{}" )"
        "ixy=\"0\" ixz=\"0\" iyy=\"{}\" iyz=\"0\" izz=\"{}\"/></inertial></link>\n",
        link.name, link.com, link.com_rpy, link.mass, ixx, iyy, izz);
    text += fmt::format(
        R"(<link name="{0}_mark"/><joint name="{0}_marked" type="fixed"><origin xyz="0.01 0.02 0.03"/>)"
        "<parent link=\"{0}\"/><child link=\"{0}_mark\"/></joint>\n",
        link.name);
    if (link.parent.empty()) continue;
    text += fmt::format(R"(<joint name="{}_joint" type="{}"><origin xyz="{}" rpy="{}"/>)", link.name,
                        link.has_joint ? "revolute" : "fixed", link.xyz, link.rpy);
    text += fmt::format(R"(<parent link="{}"/><child link="{}"/>)", link.parent, link.name);
    if (link.has_joint) {
      text +=
          fmt::format(R"(<axis xyz="{}"/><limit lower="-1.5" upper="1.5" effort="1" velocity="1"/><dynamics )"
                      R"(damping="0.25"/>)",
                      link.axis);
    }
    text += "</joint>\n";
  }
  return text + "</robot>\n";
}

std::string WriteLeggedMjcf(const std::string& name, const std::vector<LeggedLink>& links,
                            const std::string& base_joint) {
  // A URDF's roll, pitch and yaw are about axes that stand still, in this order.
  std::string text = fmt::format(
      "<mujoco model=\"{}\">\n<compiler angle=\"radian\" eulerseq=\"XYZ\"/>\n<worldbody>\n<geom "
      R"(type="plane" )"
      "size=\"1 1 1\"/>\n",
      name);
  WriteMjcfBody(links, links.front(), base_joint, &text);
  return text + "</worldbody>\n</mujoco>\n";
}

}  // namespace dexcheck::testing
