#include "harness/engine/joined_mjcf.h"

#include <tinyxml2.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>

#include "controller/common/errors.h"
#include "controller/common/text.h"

namespace dexcheck {
namespace {

using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

std::string ReadFile(const std::filesystem::path& path, const std::string& shown) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) throw InputError(shown + ": cannot be read: is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(shown + ": cannot be read");
  return {std::istreambuf_iterator<char>(file), {}};
}

void ParseXml(std::string_view text, const std::string& shown, tinyxml2::XMLDocument* document) {
  if (document->Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw InputError(shown + ":" + std::to_string(std::max(document->ErrorLineNum(), 1)) + ": is not XML, " +
                     document->ErrorName());
}

/// The first <include> at or below an element, in the order of the file.
XMLElement* FindInclude(XMLElement* element) {
  for (XMLElement* child = element->FirstChildElement(); child != nullptr;
       child = child->NextSiblingElement()) {
    if (std::string_view(child->Name()) == "include") return child;
    if (XMLElement* const found = FindInclude(child)) return found;
  }
  return nullptr;
}

}  // namespace

JoinedMjcf::JoinedMjcf(const std::filesystem::path& file) : source_(file.string()) {
  Parse(ReadFile(file, source_));
  if (!IsUrdf()) Join(file.parent_path());
}

JoinedMjcf::JoinedMjcf(std::string_view text, const std::string& source) : source_(source) { Parse(text); }

JoinedMjcf::~JoinedMjcf() = default;

void JoinedMjcf::Parse(std::string_view text) {
  document_ = std::make_unique<tinyxml2::XMLDocument>();
  ParseXml(text, source_, document_.get());
  root_ = document_->RootElement();
  if (root_ == nullptr || (std::string_view(root_->Name()) != "mujoco" && !IsUrdf())) {
    throw InputError(source_ + ": must be an MJCF, its root element <mujoco>");
  }
}

bool JoinedMjcf::IsUrdf() const { return std::string_view(root_->Name()) == "robot"; }

bool JoinedMjcf::HasWorld() const { return root_->FirstChildElement("worldbody") != nullptr; }

void JoinedMjcf::Join(const std::filesystem::path& folder) {
  while (XMLElement* const include = FindInclude(root_)) Splice(include, folder);
}

void JoinedMjcf::Splice(XMLElement* include, const std::filesystem::path& folder) {
  const char* const name = include->Attribute("file");
  if (name == nullptr) throw InputError(FindPlace(*include) + ": <include>: must have a file");
  // The engine takes all names from the folder of the file that is loaded, and each file once.
  const std::string path = (folder / name).lexically_normal().string();
  if (path == std::filesystem::path(source_).lexically_normal() ||
      std::find(files_.begin(), files_.end(), path) != files_.end()) {
    throw InputError(FindPlace(*include) + ": <include>: file " + Quote(name) +
                     ": must be included once only");
  }
  tinyxml2::XMLDocument document;
  ParseXml(ReadFile(path, FindPlace(*include) + ": file " + Quote(name)), path, &document);
  files_.push_back(path);
  XMLNode* const parent = include->Parent();
  XMLNode* last = include;
  const XMLElement* const other = document.RootElement();
  const XMLElement* child = other != nullptr ? other->FirstChildElement() : nullptr;
  for (; child != nullptr; child = child->NextSiblingElement())
    last = parent->InsertAfterChild(last, Clone(*child, &files_.back()));
  parent->DeleteChild(include);
}

XMLElement* JoinedMjcf::Clone(const XMLElement& element, const std::string* file) {
  XMLElement* const copy = element.ShallowClone(document_.get())->ToElement();
  places_.push_back({file, element.GetLineNum()});
  copy->SetUserData(&places_.back());
  for (const XMLNode* child = element.FirstChild(); child != nullptr; child = child->NextSibling()) {
    const XMLElement* const inner = child->ToElement();
    copy->InsertEndChild(inner != nullptr ? Clone(*inner, file) : child->ShallowClone(document_.get()));
  }
  return copy;
}

JoinedMjcf::Place JoinedMjcf::ReadPlace(const XMLElement& element) const {
  if (const auto* const place = static_cast<const Place*>(element.GetUserData())) return *place;
  return {&source_, std::max(element.GetLineNum(), 1)};
}

std::string JoinedMjcf::FindPlace(const XMLElement& element) const {
  const Place place = ReadPlace(element);
  return *place.file + ":" + std::to_string(place.line);
}

void JoinedMjcf::Note(const XMLElement& element, const std::string& word, const std::string& what) {
  const Place place = ReadPlace(element);
  changes_.push_back({*place.file, place.line, word, what});
}

std::string JoinedMjcf::Print() const {
  tinyxml2::XMLPrinter printer;
  document_->Print(&printer);
  return printer.CStr();
}

}  // namespace dexcheck
