"""Commands that read texts of chronicles."""
