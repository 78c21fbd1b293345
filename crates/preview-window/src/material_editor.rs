//! The edits of a material: its values in the file and in the window, and the steps between them.

use brdf::Value;
use preview::{FormField, MaterialForm};

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MaterialEditor {
    /// The values in the file.
    file: MaterialForm,
    /// The values that are being written to the file.
    saving: Option<MaterialForm>,
    /// The values in the window.
    form: MaterialForm,
    undo: Vec<MaterialForm>,
    redo: Vec<MaterialForm>,
    /// The parameter that is being dragged: its changes are one step.
    dragged: Option<FormField>,
    /// The file's new values, or why it cannot be edited any more, while there are unsaved values.
    conflict: Option<Result<MaterialForm, String>>,
}

impl MaterialEditor {
    /// The editor of a file. `edited` are the unsaved values of an earlier window.
    pub(crate) fn new(file: MaterialForm, edited: Option<MaterialForm>) -> Self {
        let undo = if edited.is_some() { vec![file.clone()] } else { Vec::new() };
        let form = edited.unwrap_or_else(|| file.clone());
        Self { file, saving: None, form, undo, redo: Vec::new(), dragged: None, conflict: None }
    }

    pub(crate) fn form(&self) -> &MaterialForm {
        &self.form
    }

    /// The values to show instead of the file's own.
    pub(crate) fn edited(&self) -> Option<&MaterialForm> {
        Some(&self.form).filter(|form| **form != self.file)
    }

    /// Whether there are unsaved values.
    pub(crate) fn is_edited(&self) -> bool {
        self.form != self.file
    }

    /// The file's new values, if the user has to choose between them and the unsaved values.
    pub(crate) fn conflict(&self) -> Option<&Result<MaterialForm, String>> {
        self.conflict.as_ref()
    }

    pub(crate) fn is_dragged(&self) -> bool {
        self.dragged.is_some()
    }

    /// Whether there is a step to undo, and one to redo.
    pub(crate) fn steps(&self) -> [bool; 2] {
        [!self.undo.is_empty(), !self.redo.is_empty()]
    }

    /// Sets a value. Until [`MaterialEditor::end_drag`], changes of one parameter are one step.
    pub(crate) fn set(&mut self, field: FormField, value: &Value) {
        let mut form = self.form.clone();
        form.set(field, value);
        if form == self.form {
            return;
        }
        if self.dragged != Some(field) {
            self.undo.push(self.form.clone());
        }
        self.redo.clear();
        (self.form, self.dragged) = (form, Some(field));
    }

    /// Ends a step.
    pub(crate) fn end_drag(&mut self) {
        self.dragged = None;
    }

    pub(crate) fn undo(&mut self) {
        self.dragged = None;
        if let Some(form) = self.undo.pop() {
            self.redo.push(std::mem::replace(&mut self.form, form));
        }
    }

    pub(crate) fn redo(&mut self) {
        self.dragged = None;
        if let Some(form) = self.redo.pop() {
            self.undo.push(std::mem::replace(&mut self.form, form));
        }
    }

    /// Returns to the values of the file, as a step that can be undone.
    pub(crate) fn revert(&mut self) {
        self.dragged = None;
        if self.is_edited() {
            self.undo.push(std::mem::replace(&mut self.form, self.file.clone()));
            self.redo.clear();
        }
    }

    /// The values to write to the file; `None` if there is nothing to save, or a conflict.
    pub(crate) fn save(&mut self) -> Option<MaterialForm> {
        self.dragged = None;
        if self.is_edited() && self.conflict.is_none() {
            self.saving = Some(self.form.clone());
            return self.saving.clone();
        }
        None
    }

    /// The values of [`MaterialEditor::save`] were written, or not.
    pub(crate) fn saved(&mut self, written: bool) {
        if let Some(form) = self.saving.take().filter(|_| written) {
            self.file = form;
        }
    }

    /// Takes the file's values. With unsaved values in the window, the user has to choose.
    pub(crate) fn follow(&mut self, file: Result<MaterialForm, String>) {
        let saved = self.saving.take();
        match file {
            // It was saved, or is as before.
            Ok(file) if file == self.form || file == self.file || saved.as_ref() == Some(&file) => {
                (self.file, self.conflict) = (file, None);
            }
            Ok(file) if !self.is_edited() => *self = Self::new(file, None),
            file => self.conflict = Some(file),
        }
    }

    /// Drops the unsaved values in favour of the file's new ones; `Err` if these cannot be edited.
    pub(crate) fn load(self) -> Result<Self, String> {
        Ok(Self::new(self.conflict.unwrap_or(Ok(self.file))?, None))
    }

    /// Keeps the unsaved values, to be written over the file's new ones. That is only possible if the file
    /// has the same parameters as before.
    pub(crate) fn keep(&mut self) {
        if self.can_keep()
            && let Some(Ok(file)) = self.conflict.take()
        {
            self.file = file;
        }
    }

    /// Whether [`MaterialEditor::keep`] is possible.
    pub(crate) fn can_keep(&self) -> bool {
        matches!(&self.conflict, Some(Ok(file)) if file.has_same_parameters(&self.form))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testkit::{EXPONENT, SPECULAR, phong_form as phong};

    fn number(editor: &MaterialEditor) -> f64 {
        match editor.form().value(EXPONENT) {
            Some(Value::Number(number)) => *number,
            other => panic!("{other:?}"),
        }
    }

    fn dragged(editor: &mut MaterialEditor, values: &[f64]) {
        values.iter().for_each(|value| editor.set(EXPONENT, &Value::Number(*value)));
        editor.end_drag();
    }

    #[test]
    fn a_drag_is_one_step_and_steps_go_back_and_forth() {
        let mut editor = MaterialEditor::new(phong(4.0), None);
        dragged(&mut editor, &[5.0, 6.0, 7.0]);
        dragged(&mut editor, &[8.0]);
        editor.set(EXPONENT, &Value::Number(9.0));
        editor.set(SPECULAR, &Value::Colour([0.5; 3]));
        editor.end_drag();
        assert_eq!(editor.steps(), [true, false]);
        let mut seen = Vec::new();
        while editor.steps()[0] {
            editor.undo();
            seen.push(number(&editor));
        }
        assert_eq!(seen, [9.0, 8.0, 7.0, 4.0], "the colour, and three steps of the exponent");
        assert!(!editor.is_edited() && editor.edited().is_none());
        editor.redo();
        editor.redo();
        assert_eq!((number(&editor), editor.steps()), (8.0, [true, true]));
        dragged(&mut editor, &[3.0]);
        assert_eq!(editor.steps(), [true, false], "another change ends the steps forward");
        dragged(&mut editor, &[3.0]);
        editor.undo();
        assert_eq!(number(&editor), 8.0, "no change is no step");
    }

    #[test]
    fn a_revert_is_a_step() {
        let mut editor = MaterialEditor::new(phong(4.0), None);
        dragged(&mut editor, &[5.0]);
        editor.revert();
        assert!(!editor.is_edited());
        editor.revert();
        editor.undo();
        assert_eq!(number(&editor), 5.0);
    }

    #[test]
    fn after_saving_the_values_are_those_of_the_file_and_steps_remain() {
        let mut editor = MaterialEditor::new(phong(4.0), None);
        assert_eq!(editor.save(), None);
        dragged(&mut editor, &[6.0]);
        assert_eq!(editor.save(), Some(phong(6.0)));
        // The slider is dragged before the file is written.
        dragged(&mut editor, &[5.0]);
        editor.follow(Ok(phong(6.0)));
        assert!(editor.is_edited() && editor.conflict().is_none());
        assert_eq!(editor.save(), Some(phong(5.0)));
        editor.follow(Ok(phong(5.0)));
        assert!(!editor.is_edited() && editor.conflict().is_none());
        editor.undo();
        assert!(editor.is_edited(), "the file has 5");
        editor.follow(Ok(phong(5.0)));
        assert!(editor.conflict().is_none(), "the file has not changed");
    }

    #[test]
    fn a_file_that_changes_is_followed_unless_there_are_unsaved_values() {
        let mut editor = MaterialEditor::new(phong(4.0), None);
        editor.follow(Ok(phong(6.0)));
        assert_eq!((number(&editor), editor.steps()), (6.0, [false, false]));
        dragged(&mut editor, &[5.0]);
        editor.follow(Ok(phong(7.0)));
        assert_eq!((number(&editor), editor.conflict()), (5.0, Some(&Ok(phong(7.0)))));
        assert_eq!(number(&editor.clone().load().unwrap()), 7.0);
        editor.keep();
        assert_eq!((number(&editor), editor.conflict(), editor.is_edited()), (5.0, None, true));
        editor.revert();
        assert_eq!(number(&editor), 7.0, "that is what the file has now");
        // Its changes were undone by another program.
        dragged(&mut editor, &[5.0]);
        editor.follow(Ok(phong(8.0)));
        editor.follow(Ok(phong(7.0)));
        assert_eq!(editor.conflict(), None);
    }

    #[test]
    fn unsaved_values_cannot_be_kept_for_a_file_of_other_parameters() {
        let mut editor = MaterialEditor::new(phong(4.0), None);
        dragged(&mut editor, &[5.0]);
        let mut other = phong(4.0);
        other.sections[0].parameters.pop();
        for file in [Ok(other), Err("it has errors".to_owned())] {
            editor.follow(file.clone());
            assert!(!editor.can_keep());
            editor.keep();
            assert_eq!(editor.conflict(), Some(&file));
        }
        assert_eq!(editor.load(), Err("it has errors".into()));
    }

    #[test]
    fn the_unsaved_values_of_an_earlier_window_can_be_undone() {
        let mut editor = MaterialEditor::new(phong(4.0), Some(phong(5.0)));
        assert!(editor.is_edited());
        editor.undo();
        assert!(!editor.is_edited());
    }
}
