#include "controller/model/parameter_reader.h"

#include <utility>

#include "controller/common/text.h"
#include "controller/common/toml_reader.h"
#include "controller/model/segment_reader.h"

namespace dexcheck {
namespace {

/// Reads [lengths]; each may use those before it.
void DefineLengths(TomlTable& root, TomlDocument& document) {
  const std::optional<TomlValue> lengths = root.Find("lengths");
  if (!lengths) return;
  for (const auto& [name, value] : lengths->AsTable().GetEntries()) {
    if (!IsSymbolName(name)) {
      value.Reject("must be named by letters, digits and _, other than pi, got " + Quote(name));
    }
    document.Define(name, value.AsNumber());
  }
}

/// The wheels as cylinders of the given radius, or with their moments of inertia given.
void ReadWheels(const TomlValue& value, Base& base) {
  TomlTable table = value.AsTable();
  base.wheel_joint_right = table.Get("right").AsPartName();
  base.wheel_joint_left = table.Get("left").AsPartName();
  if (base.wheel_joint_left == base.wheel_joint_right) table.Get("left").Fail("must differ from right");
  WheelProperties& wheel = base.wheel;
  wheel.mass = table.Get("mass").AsNotNegative();
  wheel.damping = table.Get("damping").AsNotNegative();
  wheel.armature = table.Get("armature").AsNotNegative();

  table.RejectTogether("width", {"spin_inertia", "transverse_inertia"});
  if (const std::optional<TomlValue> width = table.Find("width")) {
    const Matrix3d inertia =
        CalcUniformInertia(SolidCylinder{base.wheel_radius, width->AsPositive()}, wheel.mass);
    wheel.spin_inertia = inertia(2, 2);
    wheel.transverse_inertia = inertia(0, 0);
  } else {
    wheel.spin_inertia = table.Get("spin_inertia").AsNotNegative();
    wheel.transverse_inertia = table.Get("transverse_inertia").AsNotNegative();
  }
  const Vector3d moments(wheel.transverse_inertia, wheel.spin_inertia, wheel.transverse_inertia);
  CheckBody(value, {wheel.mass, Vector3d::Zero(), moments.asDiagonal()});
  table.RejectUnused();
}

void ReadDrive(TomlTable& table, Base& base) {
  base.velocity = table.Get("velocity")
                      .AsChoice<DriveVelocity>(
                          {{"twist", DriveVelocity::kTwist}, {"wheel_rates", DriveVelocity::kWheelRates}});
  base.wheel_radius = table.Get("wheel_radius").AsPositive();
  base.wheel_distance = table.Get("wheel_distance").AsPositive();
  ReadWheels(table.Get("wheels"), base);
  // Sigma_0 stands on the axle, and the wheels on the floor.
  base.X_B0.translation().z() = base.wheel_radius;
}

Base ReadBase(const TomlValue& value) {
  TomlTable table = value.AsTable();
  Base base;
  base.type = table.Get("type").AsChoice<BaseType>({{"fixed", BaseType::kFixed},
                                                    {"planar", BaseType::kPlanar},
                                                    {"differential_drive", BaseType::kDifferentialDrive},
                                                    {"floating", BaseType::kFloating}});
  base.link = table.Get("link").AsPartName();
  if (base.type == BaseType::kDifferentialDrive) {
    ReadDrive(table, base);
  } else if (const std::optional<TomlValue> pose = table.Find("pose")) {
    base.X_B0 = ReadPose(*pose);
  }
  if (base.type != BaseType::kFixed) base.body = ReadBody(table);
  table.RejectUnused();
  return base;
}

/// The object's shape with its uniform inertia, or with the inertia given.
ObjectModel ReadObject(const TomlValue& value) {
  TomlTable table = value.AsTable();
  ObjectModel object;
  object.name = table.Get("body").AsPartName();
  object.shape = ReadShape(table);
  object.body.mass = table.Get("mass").AsPositive();
  const std::optional<TomlValue> inertia = table.Find("inertia");
  object.body.inertia = inertia ? ReadInertia(*inertia) : CalcUniformInertia(object.shape, object.body.mass);
  CheckBody(inertia.value_or(value), object.body);
  object.friction = table.Get("friction").AsPositive();
  table.RejectUnused();
  return object;
}

RobotModel ReadRobot(TomlTable& root, std::string_view source, TomlDocument& document,
                     std::vector<WrittenRow>* rows) {
  // First of all, since a misspelt section makes others look wrong.
  root.RejectOthersThan({"name", "gravity", "lengths", "base", "chain", "template", "frame", "object"});
  DefineLengths(root, document);

  RobotSpec spec;
  spec.source = source;
  spec.name = root.Get("name").AsText();
  spec.gravity = root.Get("gravity").AsVector<3>();
  spec.base = ReadBase(root.Get("base"));
  std::vector<WrittenRow> written = ReadTree(root, spec);
  if (rows != nullptr) *rows = std::move(written);
  if (const std::optional<TomlValue> object = root.Find("object")) spec.object = ReadObject(*object);
  document.RejectMissing();
  return RobotModel(std::move(spec));
}

}  // namespace

RobotModel ParseRobotModel(std::string_view text, std::string_view source,
                           std::span<const std::string> overrides, std::vector<WrittenRow>* rows) {
  return ParseRobotModel(TomlDocument(text, source), source, overrides, rows);
}

RobotModel ParseRobotModel(TomlDocument document, std::string_view source,
                           std::span<const std::string> overrides, std::vector<WrittenRow>* rows) {
  std::vector<std::string> given;
  if (const std::optional<TomlValue> lengths = document.Open().Find("lengths"))
    for (const auto& [name, value] : lengths->AsTable().GetEntries()) given.push_back(name);
  for (const std::string& assignment : overrides) document.Override(assignment);
  return document.Read([&](TomlTable root) {
    // A length that an assignment adds would change nothing: it is misspelt.
    if (const std::optional<TomlValue> lengths = root.Find("lengths"); lengths && !overrides.empty()) {
      TomlTable table = lengths->AsTable();
      for (const std::string& name : given) (void)table.Find(name);
      table.RejectUnused();
    }
    return ReadRobot(root, source, document, rows);
  });
}

RobotModel ReadRobotModel(const std::filesystem::path& path, std::vector<WrittenRow>* rows) {
  return ParseRobotModel(ReadTextFile(path.string()), path.string(), {}, rows);
}

}  // namespace dexcheck
