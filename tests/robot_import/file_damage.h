// Robots' files damaged as files are: in structure, in numbers, in bytes. A seed gives the same
// files on every machine.
#pragma once

#include <random>
#include <span>
#include <string>
#include <vector>

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace poise {

class FileDamage {
 public:
  explicit FileDamage(unsigned seed) : random_(seed) {}

  /// XML with one to three damages; `done` gets their names, "drop element, byte".
  std::string Xml(const tinyxml2::XMLDocument& whole, std::string* done);
  /// Protobuf text, line by line.
  std::string Text(const std::string& whole, std::string* done);
  /// Bytes alone, of any file.
  std::string Bytes(std::string text);

  size_t Below(size_t n);

 private:
  using Elements = std::vector<tinyxml2::XMLElement*>;
  /// One of a name that stands in the document, each name as likely as another.
  tinyxml2::XMLElement* Any(tinyxml2::XMLDocument* document);
  /// The attribute's name; empty when there is none.
  std::string AnyAttribute(const tinyxml2::XMLElement& element);
  std::string AnyToken();
  std::string AnyNameOf(tinyxml2::XMLDocument* document);

  void DropElement(tinyxml2::XMLDocument* document);
  void DuplicateElement(tinyxml2::XMLDocument* document);
  void RenameElement(tinyxml2::XMLDocument* document);
  void MoveElement(tinyxml2::XMLDocument* document);
  void DropAttribute(tinyxml2::XMLDocument* document);
  void RenameAttribute(tinyxml2::XMLDocument* document);
  void SetAttribute(tinyxml2::XMLDocument* document);
  void SetNumber(tinyxml2::XMLDocument* document);
  void ChangeLength(tinyxml2::XMLDocument* document);
  void SetName(tinyxml2::XMLDocument* document);
  void CloseLoop(tinyxml2::XMLDocument* document);
  void NestDeeply(tinyxml2::XMLDocument* document);
  void RepeatOften(tinyxml2::XMLDocument* document);
  void BreakMass(tinyxml2::XMLDocument* document);
  void PutMesh(tinyxml2::XMLDocument* document);
  void AddForeign(tinyxml2::XMLDocument* document);
  std::string EntityBomb(std::string text);

  std::mt19937 random_;
};

}  // namespace poise
