#include "harness/descriptions/urdf_shapes.h"

#include <set>
#include <string_view>
#include <utility>

#include "controller/common/errors.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using Element = tinyxml2::XMLElement;

/// Volume and box of a primitive shape; a mesh has no volume here.
DescribedShape ReadShape(const UrdfFile& file, const Element& use) {
  const Pose X_LS = file.ReadOrigin(use, "");
  const Element* const geometry = use.FirstChildElement("geometry");
  const Element* const solid = geometry == nullptr ? nullptr : geometry->FirstChildElement();
  if (solid == nullptr) file.Fail(use.GetLineNum(), "geometry: missing");
  const std::string_view kind = solid->Name();
  const auto read = [&](const char* attribute) { return file.ReadNumber(*solid, "", attribute); };
  DescribedShape shape;
  Vector3d half = Vector3d::Zero();
  if (kind == "sphere") {
    const double r = read("radius");
    half.setConstant(r);
    shape.volume = 4.0 / 3.0 * kPi * r * r * r;
  } else if (kind == "box" && solid->Attribute("size") != nullptr) {
    const Vector3d size = file.ReadVector(*solid, "", "size", half);
    half = 0.5 * size;
    shape.volume = size.x() * size.y() * size.z();
  } else if (kind == "cylinder") {
    const double length = read("length");
    const double r = read("radius");
    half << r, r, 0.5 * length;
    shape.volume = kPi * r * r * length;
  } else if (kind == "mesh" && solid->Attribute("filename") != nullptr) {
    file.ReadVector(*solid, "", "scale", half);
  } else {
    file.Fail(solid->GetLineNum(), "geometry: must be a shape");
  }
  const Vector3d around = kind == "sphere" ? half : Vector3d(X_LS.linear().cwiseAbs() * half);
  shape.low = X_LS.translation() - around;
  shape.high = X_LS.translation() + around;
  return shape;
}

/// The file of a mesh; empty when it is in none of the packages.
std::filesystem::path FindMesh(const std::string& name, const std::filesystem::path& folder,
                               const std::vector<std::filesystem::path>& packages) {
  std::vector<std::filesystem::path> candidates;
  constexpr std::string_view kPackage = "package://";
  constexpr std::string_view kFile = "file://";
  if (name.starts_with(kPackage)) {
    const std::filesystem::path path = name.substr(kPackage.size());
    const std::filesystem::path package = path.begin() == path.end() ? path : *path.begin();
    for (const std::filesystem::path& root : packages) {
      candidates.push_back(root / path);
      if (std::filesystem::absolute(root).lexically_normal().filename() == package) {
        candidates.push_back(root / path.lexically_relative(package));
      }
    }
  } else {
    candidates.push_back(folder / (name.starts_with(kFile) ? name.substr(kFile.size()) : name));
  }
  for (const std::filesystem::path& path : candidates) {
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) return path;
  }
  return {};
}

}  // namespace

std::vector<DescribedShape> ReadShapes(const UrdfFile& file, const UrdfLink& link) {
  std::vector<DescribedShape> seen;
  std::vector<DescribedShape> touching;
  try {
    for (const auto& [use, shapes] : {std::pair("visual", &seen), std::pair("collision", &touching)}) {
      for (const Element* shape : ListChildren(link.element, use)) shapes->push_back(ReadShape(file, *shape));
    }
  } catch (const InputError&) {
  }
  return touching.empty() ? seen : touching;
}

std::vector<std::string> ListMissingMeshes(const UrdfFile& file, const std::filesystem::path& folder,
                                           const std::vector<std::filesystem::path>& packages) {
  std::set<std::string> seen;
  std::vector<std::string> missing;
  for (const UrdfLink& link : file.links()) {
    for (const char* use : {"visual", "collision"}) {
      for (const Element* shape : ListChildren(link.element, use)) {
        const Element* const geometry = shape->FirstChildElement("geometry");
        const Element* const mesh = geometry == nullptr ? nullptr : geometry->FirstChildElement("mesh");
        const char* const name = mesh == nullptr ? nullptr : mesh->Attribute("filename");
        if (name == nullptr || !seen.insert(name).second) continue;
        if (FindMesh(name, folder, packages).empty()) missing.emplace_back(name);
      }
    }
  }
  return missing;
}

}  // namespace dexcheck
