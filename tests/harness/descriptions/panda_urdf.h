#pragma once

// The Panda as its manufacturer's robot description has it, with the masses of mjcf/panda.xml.

#include <fmt/format.h>

#include <string>

namespace dexcheck::testing {

inline std::string MakePandaUrdf() {
  struct Row {
    const char* xyz;
    const char* rpy;
    const char* lower;
    const char* upper;
    const char* mass;
    const char* com;
    double I[6];  // xx yy zz xy xz yz
  };
  constexpr const char* kBack = "-1.5707963267948966 0 0";
  constexpr const char* kForth = "1.5707963267948966 0 0";
  const Row rows[] = {
      {"0 0 0.333",
       "0 0 0",
       "-2.8973",
       "2.8973",
       "4.970684",
       "0.003875 0.002081 -0.04762",
       {0.70337, 0.70661, 0.009117, -0.000139, 0.006772, 0.019169}},
      {"0 0 0",
       kBack,
       "-1.7628",
       "1.7628",
       "0.646926",
       "-0.003141 -0.02872 0.003495",
       {0.007962, 0.02811, 0.025995, -0.003925, 0.010254, 0.000704}},
      {"0 -0.316 0",
       kForth,
       "-2.8973",
       "2.8973",
       "3.228604",
       "0.027518 0.039252 -0.066502",
       {0.037242, 0.036155, 0.01083, -0.004761, -0.011396, -0.012805}},
      {"0.0825 0 0",
       kForth,
       "-3.0718",
       "-0.0698",
       "3.587895",
       "-0.05317 0.104419 0.027454",
       {0.025853, 0.019552, 0.028323, 0.007796, -0.001332, 0.008641}},
      {"-0.0825 0.384 0",
       kBack,
       "-2.8973",
       "2.8973",
       "1.225946",
       "-0.011953 0.041065 -0.038437",
       {0.035549, 0.029474, 0.008627, -0.002117, -0.004037, 0.000229}},
      {"0 0 0",
       kForth,
       "-0.0175",
       "3.7525",
       "1.666555",
       "0.060149 -0.014117 -0.010517",
       {0.001964, 0.004354, 0.005433, 0.000109, -0.001158, 0.000341}},
      {"0.088 0 0",
       kForth,
       "-2.8973",
       "2.8973",
       "0.735522",
       "0.010517 -0.004252 0.061597",
       {0.012516, 0.010027, 0.004815, -0.000428, -0.001196, -0.000741}},
  };
  std::string text = "<?xml version=\"1.0\"?>\n<robot name=\"panda\">\n<link name=\"panda_link0\"/>\n";
  int i = 0;
  for (const Row& row : rows) {
    ++i;
    text += fmt::format(
        "<link name=\"panda_link{}\"><inertial><origin xyz=\"{}\" rpy=\"0 0 0\"/><mass value=\"{}\"/>\n"
        "<inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial></link>\n",
        i, row.com, row.mass, row.I[0], row.I[3], row.I[4], row.I[1], row.I[5], row.I[2]);
    text += fmt::format(
        "<joint name=\"panda_joint{}\" type=\"revolute\"><origin rpy=\"{}\" xyz=\"{}\"/>\n"
        "<parent link=\"panda_link{}\"/><child link=\"panda_link{}\"/><axis xyz=\"0 0 1\"/>\n"
        R"(<limit lower="{}" upper="{}" effort="{}" velocity="2"/>)"
        "<dynamics damping=\"0.003\" friction=\"0\"/></joint>\n",
        i, row.rpy, row.xyz, i - 1, i, row.lower, row.upper, i <= 4 ? 87 : 12);
  }
  return text +
         "<link name=\"panda_flange\"/>\n<joint name=\"flange_joint\" type=\"fixed\"><origin xyz=\"0 0 "
         "0.107\"/><parent link=\"panda_link7\"/><child link=\"panda_flange\"/></joint>\n</robot>\n";
}

}  // namespace dexcheck::testing
