"""The report's sections: results in, blocks of the document out."""
