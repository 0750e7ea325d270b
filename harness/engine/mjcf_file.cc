#include "harness/engine/mjcf_file.h"

#include <algorithm>
#include <map>
#include <system_error>

#include "controller/common/text.h"
#include "harness/base/files.h"
#include "harness/engine/mjcf_passes.h"
#include "harness/engine/xml.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

bool LiesInside(const std::filesystem::path& file) {
  return !file.is_absolute() && (file.empty() || *file.begin() != "..");
}

}  // namespace

void AssetFolders::Read(const XMLElement& compiler) {
  meshes = ReadAttribute(compiler, "meshdir", ReadAttribute(compiler, "assetdir", meshes));
  textures = ReadAttribute(compiler, "texturedir", ReadAttribute(compiler, "assetdir", textures));
  strips_paths = ReadAttribute(compiler, "strippath", strips_paths ? "true" : "false") == "true";
}

std::filesystem::path AssetFolders::Find(const std::string& folder, const std::string& name) const {
  const std::filesystem::path path(name);
  return std::filesystem::path(folder) / (strips_paths ? path.filename() : path);
}

DefaultClasses::DefaultClasses(const XMLElement* root) {
  for (const XMLElement* section : ListChildren(root, "default")) Read(*section, "");
}

void DefaultClasses::Read(const XMLElement& section, const std::string& parent) {
  const std::string name = ReadAttribute(section, "class", parent.empty() ? "main" : "");
  if (parent.empty()) top_ = name;
  classes_[name].parent = parent;
  classes_[name].sections.push_back(&section);
  for (const XMLElement* child : ListChildren(&section, "default")) Read(*child, name);
}

const char* DefaultClasses::Find(const XMLElement& element, const std::string& child_class,
                                 const char* attribute) const {
  if (const char* own = element.Attribute(attribute)) return own;
  std::string name = ReadAttribute(element, "class", child_class);
  if (name.empty()) name = top_;
  for (size_t depth = 0; depth <= classes_.size(); ++depth) {
    const auto found = classes_.find(name);
    if (found == classes_.end()) break;
    for (const XMLElement* section : found->second.sections) {
      const XMLElement* const words = section->FirstChildElement(element.Name());
      const char* const value = words != nullptr ? words->Attribute(attribute) : nullptr;
      if (value != nullptr) return value;
    }
    name = found->second.parent;
  }
  return nullptr;
}

MjcfFile::MjcfFile(const std::filesystem::path& file, const std::string* text)
    : source_(file.string()), folder_(MakeAbsolute(file).parent_path()) {
  Parse(text != nullptr ? *text : ReadBytes(file));
  if (IsUrdf()) return;
  for (auto open = ListElements(root_, "include"); !open.empty(); open = ListElements(root_, "include"))
    Splice(open.front());
  // An asset that is not where the loaded file has it is looked for beside the file that names it.
  for (const AssetFile& asset : ListAssetFiles(root_)) {
    NoteInput(folder_ / asset.path);
    const Place place = ReadPlace(*asset.element);
    if (place.file == &source_ || Exists(folder_ / asset.path)) continue;
    const std::filesystem::path beside = MakeAbsolute(*place.file)
                                             .replace_filename(asset.element->Attribute(asset.attribute))
                                             .lexically_normal(),
                                from = (folder_ / asset.folder / "").lexically_normal();
    if (Exists(beside)) asset.element->SetAttribute(asset.attribute, beside.lexically_relative(from).c_str());
  }
}

MjcfFile::MjcfFile(std::string_view text, const std::string& source)
    : source_(source), folder_(CurrentFolder()) {
  Parse(text);
}

MjcfFile::~MjcfFile() = default;

void MjcfFile::Parse(std::string_view text) {
  document_ = std::make_unique<tinyxml2::XMLDocument>();
  ParseXml(text, source_, document_.get());
  root_ = document_->RootElement();
  if (root_ == nullptr || (std::string_view(root_->Name()) != "mujoco" && !IsUrdf())) {
    throw InputError(source_ + ": must be an MJCF, its root element <mujoco>");
  }
}

bool MjcfFile::IsUrdf() const { return std::string_view(root_->Name()) == "robot"; }

bool MjcfFile::HasWorld() const { return root_->FirstChildElement("worldbody") != nullptr; }

void MjcfFile::Splice(XMLElement* include) {
  const char* const name = include->Attribute("file");
  if (name == nullptr) throw InputError(FindPlace(*include) + ": <include>: must have a file");
  // The engine takes names from the folder of the file that is loaded, and later releases then from that of
  // the file that includes, and each file once.
  const std::filesystem::path own = source_;
  std::string path = (own.parent_path() / name).lexically_normal().string();
  std::filesystem::path kept = std::filesystem::path(name).lexically_normal();
  if (!Exists(path)) {
    const std::filesystem::path beside =
        std::filesystem::path(*ReadPlace(*include).file).parent_path() / name;
    if (Exists(beside)) {
      path = beside.lexically_normal().string();
      kept = beside.lexically_normal().lexically_relative(own.lexically_normal().parent_path());
    }
  }
  if (path == own.lexically_normal() || std::ranges::find(files_, path) != files_.end()) {
    throw InputError(FindPlace(*include) + ": <include>: file " + Quote(name) +
                     ": must be included once only");
  }
  tinyxml2::XMLDocument document;
  ParseXml(ReadBytes(path, kMostText, FindPlace(*include) + ": file " + Quote(name)), path, &document);
  files_.push_back(path);
  included_.push_back(kept.string());
  XMLNode* last = include;
  for (const XMLElement* child : ListChildren<const XMLElement>(document.RootElement()))
    last = include->Parent()->InsertAfterChild(last, Clone(*child, &files_.back()));
  include->Parent()->DeleteChild(include);
}

XMLElement* MjcfFile::Clone(const XMLElement& element, const std::string* file) {
  XMLElement* const copy = element.ShallowClone(document_.get())->ToElement();
  places_.push_back({file, element.GetLineNum()});
  copy->SetUserData(&places_.back());
  for (const XMLNode* child = element.FirstChild(); child != nullptr; child = child->NextSibling()) {
    const XMLElement* const inner = child->ToElement();
    copy->InsertEndChild(inner != nullptr ? Clone(*inner, file) : child->ShallowClone(document_.get()));
  }
  return copy;
}

MjcfFile::Place MjcfFile::ReadPlace(const XMLElement& element) const {
  if (const auto* const place = static_cast<const Place*>(element.GetUserData())) return *place;
  return {&source_, std::max(element.GetLineNum(), 1)};
}

std::string MjcfFile::FindPlace(const XMLElement& element) const {
  const Place place = ReadPlace(element);
  return *place.file + ":" + std::to_string(place.line);
}

void MjcfFile::Note(const XMLElement& element, const std::string& word, const std::string& what) {
  const Place place = ReadPlace(element);
  changes_.push_back({*place.file, place.line, word, what});
}

std::string MjcfFile::SummarizeChanges() const {
  constexpr size_t kMostWords = 4;
  std::map<std::string, std::map<std::string, int>> groups;
  for (const MjcfChange& change : changes_)
    ++groups[change.what.substr(0, change.what.find(", since"))][change.word];
  std::string line = source_ + ":";
  for (const auto& [what, words] : groups) {
    line += (line.back() == ':' ? " " : "; ") + what + ": ";
    size_t count = 0;
    for (const auto& [word, times] : words) {
      if (count++ >= kMostWords) continue;
      line += (count > 1 ? ", " : "") + word + (times > 1 ? " (" + std::to_string(times) + ")" : "");
    }
    if (count > kMostWords) line += " and " + std::to_string(count - kMostWords) + " more";
  }
  return line;
}

std::string MjcfFile::Print() const { return PrintXml(*document_); }

std::string MjcfFile::PrintFor(const std::filesystem::path& folder) const {
  tinyxml2::XMLDocument copy;
  document_->DeepCopy(&copy);
  XMLElement* const root = copy.RootElement();
  const auto move = [&](XMLElement* compiler, const char* name) {
    const std::filesystem::path old = ReadAttribute(*compiler, name);
    if (old.is_absolute()) return;
    std::error_code error;
    compiler->SetAttribute(name, std::filesystem::proximate(folder_ / old, folder, error).string().c_str());
  };
  for (const char* name : {"meshdir", "texturedir"}) {
    bool is_stated = false;
    for (XMLElement* compiler : ListElements(root, "compiler")) {
      if (compiler->Attribute(name) == nullptr) continue;
      move(compiler, name);
      is_stated = true;
    }
    // Without such a folder, files are looked for in the MJCF's own.
    if (!is_stated) move(RequireSection(root, "compiler"), name);
  }
  return PrintXml(copy);
}

std::vector<std::string> ListMjcfFiles(const std::filesystem::path& mjcf) {
  const MjcfFile model(mjcf);
  std::vector<std::string> files;
  const auto add = [&](const std::filesystem::path& given) {
    const std::filesystem::path file = given.lexically_normal();
    if (!LiesInside(file)) {
      throw InputError(mjcf.string() + ": file " + Quote(file.string()) +
                       ": must lie in the MJCF's folder, so that the log can keep it");
    }
    files.push_back(file.string());
  };
  add(mjcf.filename());
  for (const std::string& file : model.included()) add(file);
  for (const AssetFile& asset : ListAssetFiles(model.root())) {
    if (!LiesInside(asset.path.lexically_normal()) || Exists(model.folder() / asset.path)) add(asset.path);
  }
  std::sort(files.begin() + 1, files.end());
  files.erase(std::unique(files.begin(), files.end()), files.end());
  return files;
}

}  // namespace dexcheck
